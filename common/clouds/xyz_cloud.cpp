// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/xyz_cloud.h"

#include "common/clouds/columns.h"
#include "common/clouds/text_lines.h"

namespace berth::clouds {

namespace {

Columns named_by(const std::vector<std::string_view>& words) {
  return find_columns({words.begin(), words.end()});
}

CloudRow row_of(const TextLines& lines, const Columns& columns) {
  const auto value = [&](int column, const char* name) {
    return lines.number(static_cast<std::size_t>(column), name);
  };
  CloudRow row;
  row.point = {value(columns.x, "x"), value(columns.y, "y"), value(columns.z, "z")};
  if (columns.time >= 0) row.utime = columns.us_per_time * value(columns.time, "time");
  if (columns.sigma >= 0) row.sigma = value(columns.sigma, "sigma");
  return row;
}

}  // namespace

Cloud parse_xyz(std::string_view text, const std::string& file) {
  if (text.find('\0') != std::string_view::npos) {
    throw InputError(file + ": found binary data, expected lines of text: x y z ...");
  }
  Cloud cloud;
  Columns columns;
  TextLines lines(text, file);
  bool begun = false;
  while (lines.next()) {
    if (lines.words().empty()) {
      if (const Columns named = named_by(lines.comment()); !begun && named.has_point()) {
        columns = named;
      }
      continue;
    }
    if (!begun) {
      begun = true;
      if (double ignored = 0; !parse_number(lines.words().front(), ignored)) {
        columns = named_by(lines.words());
        if (!columns.has_point()) {
          throw lines.error(
              "found neither three numbers nor a header, expected points as 'x y z ...' or a line "
              "that names the columns x, y, z and others");
        }
        continue;
      }
      if (!columns.has_point()) columns.x = 0, columns.y = 1, columns.z = 2;
    }
    add_row(cloud, row_of(lines, columns));
  }
  if (cloud.counts.points == 0) throw InputError(file + ": holds no point");
  cloud.has_times = columns.time >= 0;
  cloud.has_sigmas = columns.sigma >= 0;
  return cloud;
}

}  // namespace berth::clouds
