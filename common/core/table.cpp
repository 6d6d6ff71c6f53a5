// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/table.h"

#include <algorithm>

#include "common/core/valid_text.h"

namespace berth {
namespace {

/// The head, where there is one, and the rows.
std::vector<std::vector<std::string>> lines_of(const Table& table) {
  auto lines = table.rows;
  if (!table.head.empty()) lines.insert(lines.begin(), table.head);
  return lines;
}

}  // namespace

std::string text_table(const Table& table) {
  auto lines = lines_of(table);
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
      const bool left = i < table.alignment.size() && table.alignment[i] == 'l';
      const std::string pad(width[i] - columns(cells[i]), ' ');
      line += (left ? cells[i] + pad : pad + cells[i]) + "  ";
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string markdown_table(const Table& table) {
  std::string text;
  for (const auto& cells : lines_of(table)) {
    const bool is_head = text.empty();
    text += "|";
    for (const std::string& cell : cells) text += " " + cell + " |";
    text += "\n";
    if (!is_head) continue;
    text += "|";
    for (std::size_t i = 0; i < cells.size(); ++i) text += "---|";
    text += "\n";
  }
  return text;
}

std::string csv_table(const Table& table) {
  std::string text;
  for (const auto& cells : lines_of(table)) {
    for (std::size_t i = 0; i < cells.size(); ++i)
      text += (i == 0 ? "" : ",") + csv_field(cells[i]);
    text += "\n";
  }
  return text;
}

}  // namespace berth
