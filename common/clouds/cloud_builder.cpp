// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/cloud_builder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

#include "common/core/beam_model.h"
#include "common/core/error.h"
#include "common/core/quantity.h"
#include "common/core/text.h"

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
  std::string unit;  ///< empty: unknown

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

/// Names that programs give to the axes: '%' stands for x, y, z, '#' for 0, 1, 2. The first
/// spelling that is complete counts.
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

struct TimeUnit {
  const char* name;
  double us;
};
constexpr std::array<TimeUnit, 4> time_units = {{{"s", 1e6}, {"ms", 1e3}, {"us", 1}, {"ns", 1e-3}}};

/// Maximum duration of a scan.
constexpr double max_scan_us = 3600e6;
/// Times since 1970 that a scanner may have: the years 2000 to 2100. In the four units these
/// intervals have no number in common.
constexpr double first_epoch_us = 946684800e6;
constexpr double last_epoch_us = 4102444800e6;

/// The unit that follows from the magnitude of times: seconds since 1970 and parts of them, else
/// seconds with decimals. Whole numbers from about 0 may be of any unit.
const TimeUnit* unit_by_magnitude(double first, double last, bool whole) {
  const auto plausible = [&](const TimeUnit& unit) {
    const bool is_seconds = unit.us == time_units[0].us;
    return (last - first) * unit.us <= max_scan_us && !(is_seconds && whole && first != last);
  };
  for (const TimeUnit& unit : time_units) {
    if (first * unit.us >= first_epoch_us && last * unit.us <= last_epoch_us) {
      return plausible(unit) ? &unit : nullptr;
    }
  }
  return plausible(time_units[0]) && !whole ? &time_units[0] : nullptr;
}

std::string unit_name(double us) {
  for (const TimeUnit& unit : time_units) {
    if (unit.us == us) return unit.name;
  }
  return shown(1e-6 * us) + " s";
}

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

void CloudBuilder::add(const CloudRow& row) {
  ++cloud_.counts.points;
  const Vector3d point(columns_.x.scale * row.point.x(), columns_.y.scale * row.point.y(),
                       columns_.z.scale * row.point.z());
  const double range = point.norm();
  if (!std::isfinite(range)) {
    ++cloud_.counts.not_finite;
    return;
  }
  if (!(range > 0)) {
    ++cloud_.counts.at_sensor;
    return;
  }
  if (row.return_number > 1) {
    ++cloud_.counts.later_returns;
    return;
  }
  CloudBeam beam;
  beam.range = range;
  beam_angles(point, beam.azimuth, beam.elevation);
  beam.hit = true;
  beam.range_sigma = columns_.sigma ? columns_.sigma.scale * row.sigma : 0;
  cloud_.beams.push_back(beam);
  times_.push_back(row.time);
  ++cloud_.counts.hits;
}

void CloudBuilder::add_empty(const Vector3d* direction) {
  ++cloud_.counts.points;
  if (direction == nullptr) {
    ++cloud_.counts.undirected;
    return;
  }
  CloudBeam miss;
  beam_angles(*direction, miss.azimuth, miss.elevation);
  cloud_.beams.push_back(miss);
  times_.push_back(std::numeric_limits<double>::quiet_NaN());
  ++cloud_.counts.misses;
  cloud_.has_misses = true;
}

void CloudBuilder::take_not_finite_as_empty() {
  cloud_.counts.undirected += std::exchange(cloud_.counts.not_finite, 0);
}

void CloudBuilder::set_sigmas() {
  if (!columns_.sigma) return;
  std::size_t unusable = 0;
  for (CloudBeam& beam : cloud_.beams) {
    if (beam.range_sigma >= 0 && std::isfinite(beam.range_sigma)) continue;
    beam.range_sigma = 0;
    ++unusable;
  }
  cloud_.has_sigmas = unusable < cloud_.beams.size();
  if (unusable == 0) return;
  note("'" + columns_.sigma.name + "' has no usable value for " + std::to_string(unusable) +
       " of " + std::to_string(cloud_.beams.size()) +
       " points (empty, negative or no number): they have the LIDAR's noise");
}

void CloudBuilder::set_times() {
  if (!columns_.time || times_.empty()) return;
  const std::string column = "'" + columns_.time.name + "'";
  const auto unused = [&](const std::string& why) {
    note("times are not used, all points are taken to be of one time: " + column + " " + why);
  };
  const auto missing =
      std::count_if(times_.begin(), times_.end(), [](double time) { return !std::isfinite(time); });
  if (missing > 0) {
    return unused("is missing or no number in " + std::to_string(missing) + " of " +
                  std::to_string(times_.size()) + " points");
  }
  const auto [first, last] = std::minmax_element(times_.begin(), times_.end());
  if (*first == 0 && *last == 0) return unused("is 0 for all");
  std::optional<double> us = options_.us_per_time ? options_.us_per_time : columns_.us_per_time;
  if (!us) {
    const bool whole = std::all_of(times_.begin(), times_.end(),
                                   [](double time) { return time == std::trunc(time); });
    const TimeUnit* const unit = unit_by_magnitude(*first, *last, whole);
    if (unit == nullptr) {
      return unused("is from " + shown(*first) + " to " + shown(*last) +
                    " and its name has no unit: give it with --time-unit");
    }
    us = unit->us;
    note("times are read as " + std::string(unit->name) + ": " + column +
         " names no unit, which is inferred from the values; --time-unit overrides it");
  }
  constexpr double max_utime = 9e18;  // what 64 bits hold
  if (!((*last - *first) * *us <= max_scan_us) || !(std::abs(*first * *us) < max_utime) ||
      !(std::abs(*last * *us) < max_utime)) {
    return unused("is from " + shown(*first) + " to " + shown(*last) + " " + unit_name(*us) +
                  ", no scan takes an hour: give the unit with --time-unit");
  }
  cloud_.has_times = true;
  for (std::size_t i = 0; i < times_.size(); ++i) {
    cloud_.beams[i].utime = std::llround(times_[i] * *us);
  }
}

Cloud CloudBuilder::finish() {
  set_sigmas();
  set_times();
  const auto scaled = [](const Column& column) { return column.scale != 1; };
  if (scaled(columns_.x) || scaled(columns_.y) || scaled(columns_.z)) {
    note("coordinates have the units of the columns '" + columns_.x.name + "', '" +
         columns_.y.name + "' and '" + columns_.z.name + "'");
  }
  return std::move(cloud_);
}

}  // namespace berth::clouds
