// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/tracker_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/text.h"

namespace berth::testbed {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (;;) {
    const auto comma = line.find(',');
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

/// Reads lines one after the other.
class Parser {
 public:
  Parser(const std::string& name, const TrackerSetup& setup) : name_(name), setup_(setup) {}

  void take(std::string_view line) {
    ++line_;
    line = trimmed(line);
    if (line.empty() || line.front() == '#') return;
    const auto cells = cells_of(line);
    if (columns_.empty()) return take_header(cells);
    if (cells.size() != width_) {
      throw error("found " + std::to_string(cells.size()) + " columns, expected " +
                  std::to_string(width_));
    }
    TrackerLine result;
    result.time = number(cells, 0);
    const std::string_view point = cells[columns_[1]];
    const auto found =
        std::find_if(setup_.reflectors.begin(), setup_.reflectors.end(),
                     [&](const Reflector& reflector) { return reflector.name == point; });
    if (found == setup_.reflectors.end()) {
      std::vector<std::string> known;
      for (const Reflector& reflector : setup_.reflectors) known.push_back(reflector.name);
      throw error("point: found '" + std::string(point) +
                  "', expected a reflector of tracker.yaml: " + joined(known));
    }
    result.reflector = static_cast<std::size_t>(found - setup_.reflectors.begin());
    for (std::size_t i = 0; i < 3; ++i) {
      result.point[static_cast<Eigen::Index>(i)] = 1e-3 * number(cells, 2 + i);
    }
    lines_.push_back(result);
  }

  std::vector<TrackerLine> result() {
    if (columns_.empty()) throw error("found no header, expected time,point,x,y,z");
    return std::move(lines_);
  }

 private:
  static constexpr const char* names[] = {"time", "point", "x", "y", "z"};

  void take_header(const std::vector<std::string_view>& cells) {
    for (const char* name : names) {
      const auto found = std::find(cells.begin(), cells.end(), name);
      if (found == cells.end()) {
        throw error(std::string("found no column '") + name +
                    "', expected a header with time,point,x,y,z");
      }
      columns_.push_back(static_cast<std::size_t>(found - cells.begin()));
    }
    for (const char* turned : {"w", "p", "r"}) {
      if (std::find(cells.begin(), cells.end(), turned) == cells.end()) continue;
      throw error(std::string("found a column '") + turned +
                  "', expected points: the attitude of a probe is not used, at least three "
                  "reflectors on each of sensor and replica determine it; leave out w, p and r");
    }
    width_ = cells.size();
  }

  double number(const std::vector<std::string_view>& cells, std::size_t column) const {
    const std::string_view text = cells[columns_[column]];
    double value = 0;
    const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
    if (end.ec != std::errc() || end.ptr != text.data() + text.size() || !std::isfinite(value)) {
      throw error(std::string(names[column]) + ": found '" + std::string(text) +
                  "', expected a number");
    }
    return value;
  }

  InputError error(const std::string& what) const {
    return InputError(name_ + ":" + std::to_string(line_) + ": " + what);
  }

  std::string name_;
  const TrackerSetup& setup_;
  std::vector<std::size_t> columns_;
  std::size_t width_ = 0;
  int line_ = 0;
  std::vector<TrackerLine> lines_;
};

}  // namespace

std::vector<TrackerLine> parse_tracker_file(std::string_view text, const std::string& name,
                                            const TrackerSetup& setup) {
  Parser parser(name, setup);
  while (!text.empty()) {
    const auto end = text.find('\n');
    parser.take(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return parser.result();
}

std::vector<TrackerLine> read_tracker_file(const std::filesystem::path& file,
                                           const TrackerSetup& setup) {
  return parse_tracker_file(read_file(file), file.string(), setup);
}

}  // namespace berth::testbed
