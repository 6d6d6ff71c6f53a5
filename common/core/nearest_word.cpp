// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/nearest_word.h"

#include <algorithm>

namespace berth {
namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_word(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t min_distance = 4;
  for (const std::string& other : known) {
    const std::size_t distance = edit_distance(word, other);
    if (distance >= min_distance) continue;
    min_distance = distance;
    nearest = other;
  }
  return nearest;
}

}  // namespace berth
