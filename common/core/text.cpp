// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "common/core/valid_text.h"

namespace berth {

std::string fixed(double value, int decimals) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  // -0.0 is nothing to tell people
  const bool zero = text[0] == '-' &&
                    std::string_view(text).find_first_of("123456789in") == std::string_view::npos;
  return zero ? text + 1 : text;
}

std::string shown(double value) {
  if (std::isnan(value)) return "-";
  const double size = std::abs(value);
  return fixed(value, size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : 3);
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string text_table(const std::vector<std::vector<std::string>>& any_lines,
                       std::size_t left_columns) {
  auto lines = any_lines;
  std::vector<std::size_t> width;
  for (auto& cells : lines) {
    width.resize(std::max(width.size(), cells.size()), 0);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      cells[i] = terminal_line(cells[i]);
      width[i] = std::max(width[i], columns(cells[i]));
    }
  }
  std::string text;
  for (const auto& cells : lines) {
    std::string line = "  ";
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string pad(width[i] - columns(cells[i]), ' ');
      line += i < left_columns ? cells[i] + pad : pad + cells[i];
      line += "  ";
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace berth
