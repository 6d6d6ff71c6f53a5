// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/clouds/cloud_builder.h"

namespace berth::clouds {

/// Declaration by a format's own header of the lines that follow; cells are separated by blanks.
struct DeclaredTable {
  std::vector<std::string> names;  ///< one for each cell of a line
  std::size_t rows = 0;
  std::size_t lines_before = 0;  ///< of the file
};

/// Reads a point a line. One decision holds for all of the text: what parts the cells (';', '|',
/// tab, ',' or blanks), whether decimals have a point or a comma, what the columns are, how many
/// there are. Columns are named by a line, or a comment, before the first point; without names x y
/// z come first. A first line with nothing but a whole number is the count of points. An ambiguous
/// text is refused. file: for messages.
/// @throws InputError naming file and line.
Table read_text_table(std::string_view text, const std::string& file,
                      const DeclaredTable* declared = nullptr);

}  // namespace berth::clouds
