// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/columns.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include "common/core/error.h"
#include "common/core/unit.h"

namespace berth::clouds {

namespace {

/// The unit as quantities have it.
std::string unit_named(std::string unit) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 22> others = {
      {{"metre", "m"},       {"metres", "m"},       {"meter", "m"},         {"meters", "m"},
       {"millimetre", "mm"}, {"millimetres", "mm"}, {"millimeter", "mm"},   {"millimeters", "mm"},
       {"\xC2\xB5m", "um"},  {"\xCE\xBCm", "um"},   {"sec", "s"},           {"second", "s"},
       {"seconds", "s"},     {"msec", "ms"},        {"milliseconds", "ms"}, {"\xC2\xB5s", "us"},
       {"\xCE\xBCs", "us"},  {"\xB5s", "us"},       {"usec", "us"},         {"microseconds", "us"},
       {"nsec", "ns"},       {"nanoseconds", "ns"}}};
  for (const auto& [other, name] : others) {
    if (unit == other) return std::string(name);
  }
  return unit;
}

bool is_unit(const std::string& name) {
  return find_unit(name, Dimension::length) || find_unit(name, Dimension::time);
}

/// A column's name: "X (mm)" is x in mm, "time_us" time in us.
struct Name {
  std::string base;
  std::string unit;  ///< empty: not said

  explicit Name(std::string name) {
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) {
      return static_cast<char>(c == ' ' || c == '.' || c == '-' ? '_' : std::tolower(c));
    });
    const char last = name.empty() ? '\0' : name.back();
    auto bracket = std::string::npos;
    if (last == ')' || last == ']') bracket = name.rfind(last == ')' ? '(' : '[');
    const auto tail = name.find_last_of("_/");
    if (bracket != std::string::npos) {
      unit = unit_named(name.substr(bracket + 1, name.size() - bracket - 2));
      name.resize(bracket);
    } else if (tail != std::string::npos && is_unit(unit_named(name.substr(tail + 1)))) {
      unit = unit_named(name.substr(tail + 1));
      name.resize(tail);
    }
    const auto end = name.find_last_not_of("_/");
    base = name.substr(0, end == std::string::npos ? 0 : end + 1);
    const auto begin = base.find_first_not_of('_');
    base.erase(0, std::min(begin, base.size()));
    if (base == "utime") {
      base = "time";
      unit = "us";
    }
  }
};

/// How programs call the axes: '%' stands for x, y, z, '#' for 0, 1, 2. The first spelling that
/// names all three counts.
constexpr std::array<std::string_view, 12> spellings = {
    "%",          "points:#",   "points_#",     "points_m_xyz:#", "points_m_xyz_#", "%1",
    "cartesian%", "position_%", "coordinate_%", "%_coordinate",   "pos_%",          "point_%"};

constexpr std::array<std::string_view, 12> times = {
    "time",        "timestamp",     "time_stamp",   "t",
    "ts",          "gpstime",       "gps_time",     "offset_time",
    "time_offset", "relative_time", "adjustedtime", "point_time"};

class Finder {
 public:
  Finder(const std::vector<std::string>& names, const std::string& where)
      : names_(names), where_(where) {
    for (const std::string& name : names) read_.emplace_back(name);
  }

  Columns columns() const {
    Columns columns;
    for (const std::string_view spelling : spellings) {
      columns.x = axis(spelling, 0);
      columns.y = axis(spelling, 1);
      columns.z = axis(spelling, 2);
      if (columns.has_point()) break;
    }
    if (!columns.has_point()) return {};
    columns.sigma = length("sigma");
    if (!columns.sigma) columns.sigma = length("range_sigma");
    const auto number = std::find_if(read_.begin(), read_.end(),
                                     [](const Name& name) { return name.base == "return_number"; });
    if (number != read_.end()) columns.return_number = column(number - read_.begin());
    const auto time = std::find_if(read_.begin(), read_.end(), [](const Name& name) {
      return std::find(times.begin(), times.end(), name.base) != times.end();
    });
    if (time != read_.end()) {
      columns.time = column(time - read_.begin());
      if (const auto unit = find_unit(time->unit, Dimension::time)) {
        columns.us_per_time = 1e6 * *unit;
      }
    }
    return columns;
  }

 private:
  Column axis(std::string_view spelling, int number) const {
    std::string base(spelling);
    for (char& c : base) {
      if (c == '%') c = static_cast<char>('x' + number);
      if (c == '#') c = static_cast<char>('0' + number);
    }
    return length(base);
  }

  Column column(std::ptrdiff_t index) const {
    return {static_cast<int>(index), names_[static_cast<std::size_t>(index)], 1};
  }

  Column length(const std::string& base) const {
    const auto is_it = [&base](const Name& name) { return name.base == base; };
    const auto found = std::find_if(read_.begin(), read_.end(), is_it);
    if (found == read_.end()) return {};
    if (std::any_of(found + 1, read_.end(), is_it)) {
      throw InputError(where_ + ": found two columns named '" + base +
                       "', expected one: leave out or rename the other");
    }
    Column column = this->column(found - read_.begin());
    if (found->unit.empty()) return column;
    const auto unit = find_unit(found->unit, Dimension::length);
    if (!unit) {
      throw InputError(where_ + ": found the unit '" + found->unit + "' of column '" + base +
                       "', expected m, mm, cm, um or km");
    }
    column.scale = *unit;
    return column;
  }

  const std::vector<std::string>& names_;
  const std::string& where_;
  std::vector<Name> read_;
};

}  // namespace

Columns Columns::first_three() {
  Columns columns;
  columns.x = {0, "x", 1};
  columns.y = {1, "y", 1};
  columns.z = {2, "z", 1};
  return columns;
}

Columns find_columns(const std::vector<std::string>& names, const std::string& where) {
  return Finder(names, where).columns();
}

}  // namespace berth::clouds
