// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/heat_map.h"

#include <algorithm>
#include <cmath>

#include "evaluation/report/axis.h"

namespace berth::report {

ColourScale::ColourScale(std::vector<double> ends, std::string unit)
    : ends_(std::move(ends)), unit_(std::move(unit)) {
  if (ends_.size() >= colours) ends_.resize(colours - 1);
}

ColourScale ColourScale::for_values(std::vector<double> values, std::string unit) {
  values.erase(
      std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); }),
      values.end());
  if (values.empty()) return {{}, std::move(unit)};
  const auto [min_value, max_value] = std::minmax_element(values.begin(), values.end());
  std::vector<double> ends;
  if (*min_value > 0 && *max_value > 10 * *min_value) {
    const double factors[] = {1, 2, 5};
    for (int power = static_cast<int>(std::floor(std::log10(*min_value)));
         power <= std::ceil(std::log10(*max_value)); ++power) {
      for (const double factor : factors) {
        const double end = factor * std::pow(10, power);
        if (end > *min_value && end < *max_value) ends.push_back(end);
      }
    }
    // Of too many decades every second or third step is kept, the highest always.
    const std::size_t every = (ends.size() + colours - 2) / (colours - 1);
    std::vector<double> kept;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if ((ends.size() - 1 - i) % every == 0) kept.push_back(ends[i]);
    }
    ends = kept;
  } else {
    for (const Tick& tick : ticks({*min_value, *max_value, false}, static_cast<int>(colours) - 2)) {
      if (tick.value > *min_value && tick.value < *max_value) ends.push_back(tick.value);
    }
  }
  return {std::move(ends), std::move(unit)};
}

std::size_t ColourScale::colour_of(std::size_t place) const {
  return ends_.empty() ? 0 : place * (colours - 1) / ends_.size();
}

std::string ColourScale::class_of(double value) const {
  if (std::isnan(value)) return "qn";
  const auto end = std::lower_bound(ends_.begin(), ends_.end(), value);
  return "q" + std::to_string(colour_of(static_cast<std::size_t>(end - ends_.begin())));
}

Html ColourScale::legend() const {
  Html classes;
  for (std::size_t i = 0; i <= ends_.size(); ++i) {
    const std::string words = ends_.empty()      ? "all"
                              : i < ends_.size() ? "≤ " + brief(ends_[i], 3)
                                                 : "> " + brief(ends_.back(), 3);
    classes +=
        element("span", "",
                element("i", {{"class", "q" + std::to_string(colour_of(i))}}, {}) + text(words));
  }
  return element("span", "colours", classes + text(unit_));
}

Html html_of(const HeatMap& map, const ColourScale& scale) {
  Html rows;
  for (std::size_t row = map.cells.size(); row-- > 0;) {
    Html cells = element("th", "", text(map.y_labels[row]));
    for (const HeatMap::Cell& cell : map.cells[row]) {
      cells += element("td", {{"class", scale.class_of(cell.value)}, {"title", cell.hover}},
                       text(cell.shown));
    }
    rows += element("tr", "", cells);
  }
  Html labels = element("th", "", {});
  for (const std::string& label : map.x_labels) labels += element("th", "", text(label));
  const Html name =
      element("th", {{"class", "name"}, {"colspan", map.x_labels.size()}}, text(map.x_name));
  const Html table =
      element("caption", "", text(map.y_name)) + element("tbody", "", rows) +
      element("tfoot", "",
              element("tr", "", labels) + element("tr", "", element("th", "", {}) + name));
  return element("figure", "heat",
                 element("figcaption", "",
                         element("b", "", text(map.title)) + text(" ") + scale.legend()) +
                     element("div", "scroll", element("table", "", table))) +
         markup("\n");
}

}  // namespace berth::report
