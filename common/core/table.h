// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth {

/// A head and rows of cells, which may be shorter than it.
template <class Cell>
struct TableOf {
  std::string alignment;  ///< of the columns, 'l'eft or 'r'ight; columns beyond it: right
  std::vector<std::string> head{};
  std::vector<std::vector<Cell>> rows{};
};

/// A table of texts, rendered here; that of HTML is in evaluation/report/html.h.
using Table = TableOf<std::string>;

/// For a terminal, indented by two blanks; control characters in cells have no effect.
std::string text_table(const Table& table);
/// Markdown, as GitHub reads it. The alignment is left to its reader.
std::string markdown_table(const Table& table);
/// CSV (RFC 4180).
std::string csv_table(const Table& table);

}  // namespace berth
