// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <concepts>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "common/core/svg.h"

namespace berth {

/// One model of tables; renderers of text, Markdown, CSV and JSON are below, that of HTML in
/// evaluation/report/html.h, that of JUnit in evaluation/compare/junit.h.
struct Table {
  /// A value as shown to people and, where JSON has another, the value itself.
  struct Cell {
    Cell() = default;
    Cell(std::string shown) : text(std::move(shown)) {}
    Cell(const char* shown) : text(shown) {}
    /// For HTML alone.
    Cell(svg::Markup drawn) : drawing(std::move(drawn)) {}
    template <std::integral Number>
    Cell(Number number) : Cell(std::to_string(number), number) {}
    /// A number or bool, and the text in which it is shown. One that is not finite is null in JSON.
    template <class Number>
    requires std::is_arithmetic_v<Number> Cell(std::string shown, Number number)
        : text(std::move(shown)), value(number) {}

    std::string text;
    /// Empty: the text.
    std::variant<std::monostate, bool, int, long, unsigned, unsigned long, double> value;
    svg::Markup drawing;  ///< in HTML, instead of the text
    std::string link;     ///< in HTML, to a file relative to the page's directory
  };

  /// The heading is for people, the key for JSON: the heading itself unless given. A column with an
  /// empty heading and a key is in JSON alone, one with an empty key is not in JSON.
  struct Column {
    Column(std::string heading_of) : heading(std::move(heading_of)), key(heading) {}
    Column(const char* heading_of) : Column(std::string(heading_of)) {}
    Column(std::string heading_of, std::string key_of)
        : heading(std::move(heading_of)), key(std::move(key_of)) {}

    bool shown() const { return key.empty() || !heading.empty(); }

    std::string heading;
    std::string key;
  };

  /// How it went with the subject of a row: its colour in HTML, its result in JUnit.
  enum class Status { none, passed, failed, inconclusive, error };
  using enum Status;

  /// Cells, which may be fewer than the columns; JSON leaves out keys of the missing ones.
  struct Row {
    Row() = default;
    Row(std::initializer_list<Cell> list) : cells(list) {}
    Row(std::vector<Cell> list, Status status_of = none, std::string name_of = {},
        std::string note_of = {}, double time_s_of = 0)
        : cells(std::move(list)),
          status(status_of),
          name(std::move(name_of)),
          note(std::move(note_of)),
          time_s(time_s_of) {}

    std::vector<Cell> cells;
    Status status = none;
    std::string name;   ///< of its subject
    std::string note;   ///< below a table of text, at the end of a message of JUnit
    double time_s = 0;  ///< duration in JUnit
  };

  std::string alignment;  ///< of the columns shown, 'l'eft or 'r'ight; columns beyond it: right
  std::vector<Column> head{};
  std::vector<Row> rows{};  ///< where they have a status, the first column shown names it

  /// The cells of a row that people see.
  std::vector<Cell> shown(const Row& row) const;
  /// The headings above them.
  std::vector<std::string> headings() const;
};

inline Table::Column keyed(std::string heading, std::string key) {
  return {std::move(heading), std::move(key)};
}
inline Table::Column json_only(std::string key) { return {"", std::move(key)}; }
inline Table::Column no_json(std::string heading) { return {std::move(heading), ""}; }
/// A number or bool, and the text in which it is shown, if it is.
template <class Number>
Table::Cell valued(std::string shown, Number number) {
  return {std::move(shown), number};
}

/// For a terminal, indented by two blanks, the notes below; control characters in cells have no
/// effect.
std::string text_table(const Table& table);
/// Markdown, as GitHub reads it. The alignment is left to its reader.
std::string markdown_table(const Table& table);
/// CSV (RFC 4180).
std::string csv_table(const Table& table);
/// JSON: an array of one object a row.
nlohmann::ordered_json json_table(const Table& table);
/// On standard output, as JSON or as text.
void print_table(const Table& table, bool json);

}  // namespace berth
