// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/table.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/core/valid_text.h"

namespace berth {
namespace {

/// The head, where there is one, and the rows, as people see them.
std::vector<std::vector<std::string>> lines_of(const Table& table) {
  std::vector<std::vector<std::string>> lines;
  if (!table.head.empty()) lines.push_back(table.headings());
  for (const Table::Row& row : table.rows) {
    auto& line = lines.emplace_back();
    for (Table::Cell& cell : table.shown(row)) line.push_back(std::move(cell.text));
  }
  return lines;
}

nlohmann::ordered_json json_of(const Table::Cell& cell) {
  return std::visit(
      [&cell](const auto& value) -> nlohmann::ordered_json {
        if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>) return value;
        return cell.text;
      },
      cell.value);
}

}  // namespace

std::vector<Table::Cell> Table::shown(const Row& row) const {
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    if (i >= head.size() || head[i].shown()) cells.push_back(row.cells[i]);
  }
  return cells;
}

std::vector<std::string> Table::headings() const {
  std::vector<std::string> headings;
  for (const Column& column : head) {
    if (column.shown()) headings.push_back(column.heading);
  }
  return headings;
}

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
  for (const Table::Row& row : table.rows) {
    if (!row.note.empty()) text += terminal_line("  " + row.name + ": " + row.note) + "\n";
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

nlohmann::ordered_json json_table(const Table& table) {
  auto rows = nlohmann::ordered_json::array();
  for (const Table::Row& row : table.rows) {
    auto& object = rows.emplace_back(nlohmann::ordered_json::object());
    for (std::size_t i = 0; i < std::min(row.cells.size(), table.head.size()); ++i) {
      if (!table.head[i].key.empty()) object[table.head[i].key] = json_of(row.cells[i]);
    }
  }
  return rows;
}

void print_table(const Table& table, bool json) {
  print_text(json ? json_text(json_table(table), 2) + "\n" : text_table(table));
}

}  // namespace berth
