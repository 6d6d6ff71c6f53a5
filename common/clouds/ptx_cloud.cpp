// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/ptx_cloud.h"

#include "common/clouds/beam_grid.h"
#include "common/clouds/cloud_builder.h"
#include "common/clouds/text_lines.h"
#include "common/core/text.h"

namespace berth::clouds {

namespace {

/// The next line that holds anything.
bool next_line(TextLines& lines) {
  while (lines.next()) {
    if (!lines.cells().empty()) return true;
  }
  return false;
}

void expect_numbers(TextLines& lines, std::size_t count, const char* what) {
  if (!next_line(lines)) throw lines.error(std::string("the file ends, expected ") + what);
  if (lines.cells().size() != count) {
    throw lines.error("found " + std::to_string(lines.cells().size()) + " columns, expected " +
                      what);
  }
  for (std::size_t i = 0; i < count; ++i) lines.number(i, what);
}

std::size_t expect_count(TextLines& lines, const char* what) {
  expect_numbers(lines, 1, what);
  return lines.count(0, what);
}

}  // namespace

Cloud parse_ptx(std::string_view text, const std::string& file, const CloudOptions& options) {
  TextLines lines(text, file);
  const std::size_t columns = expect_count(lines, "the number of columns");
  const std::size_t rows = expect_count(lines, "the number of rows");
  expect_numbers(lines, 3, "the scanner's position: 3 numbers");
  for (int i = 0; i < 3; ++i) expect_numbers(lines, 3, "the scanner's axes: 3 lines of 3 numbers");
  for (int i = 0; i < 4; ++i) expect_numbers(lines, 4, "a matrix: 4 lines of 4 numbers");
  constexpr std::size_t shortest_line = 6;  // "0 0 0\n"
  const std::size_t beams = columns * rows;
  if (beams > lines.bytes_left() / shortest_line + 1) {
    throw lines.error("found a file too short for " + std::to_string(columns) + " columns of " +
                      std::to_string(rows) + " beams");
  }

  std::vector<Vector3d> points(beams);
  std::size_t width = 0;
  for (std::size_t i = 0; i < beams; ++i) {
    if (!next_line(lines)) {
      throw lines.error("the file ends after " + std::to_string(i) + " beams, expected " +
                        std::to_string(columns) + " columns of " + std::to_string(rows) + " beams");
    }
    if (i == 0) width = lines.cells().size();
    if (lines.cells().size() != width) {
      throw lines.error("found " + std::to_string(lines.cells().size()) + " columns, expected " +
                        std::to_string(width) + " as in the first beam");
    }
    points[i] = {lines.number(0, "x"), lines.number(1, "y"), lines.number(2, "z")};
  }
  if (next_line(lines)) {
    throw lines.error(lines.cells().size() == 1
                          ? "found a second scan, expected one a file: each has its own frame"
                          : "found more than the " + std::to_string(beams) +
                                " beams that columns and rows promise");
  }

  const BeamGrid grid(points, rows);
  const Columns first_three = Columns::first_three();
  CloudBuilder cloud(first_three, options);
  bool all_directed = true;
  for (std::size_t i = 0; i < beams; ++i) {
    if (points[i] != Vector3d::Zero()) {
      cloud.add({points[i]});
      continue;
    }
    Vector3d direction;
    const bool directed = grid.direction(i / rows, i % rows, direction);
    cloud.add_empty(directed ? &direction : nullptr);
    all_directed = all_directed && directed;
  }
  if (!all_directed) {
    cloud.note(grid.regular()
                   ? "the returns are too few to tell the direction of all empty beams"
                   : "the beams are no regular grid (" + fixed(1e3 * grid.misfit_rad(), 1) +
                         " mrad off): nothing tells the directions of the empty ones");
  }
  return cloud.finish();
}

}  // namespace berth::clouds
