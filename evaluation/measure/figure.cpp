// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/figure.h"

#include <algorithm>

namespace berth::evaluation {
namespace {

constexpr const char* coordinates[] = {"x", "y", "z", "w", "p", "r"};

std::optional<berth::Dimension> dimension_of(const std::string& name) {
  if (const auto index = coordinate_named(name)) {
    return *index < 3 ? berth::Dimension::length : berth::Dimension::angle;
  }
  const Measurement* measurement = measurement_named(name);
  if (measurement == nullptr || !measurement->series) return std::nullopt;
  return measurement->dimension;
}

void check_draw(const FigureChart& chart, const Config& config) {
  for (const std::string& name : chart.draw) {
    const auto dimension = dimension_of(name);
    if (!dimension || (chart.statistic && coordinate_named(name))) {
      throw config.error("draw", "found '" + name + "', expected measurements that are series" +
                                     (chart.statistic ? "" : ", or x y z w p r") +
                                     "; berth compare --list names them");
    }
    if (*dimension != chart.dimension()) {
      throw config.error("draw", "'" + name + "' and '" + chart.draw.front() +
                                     "' have different units, expected one unit in a chart");
    }
  }
  if (chart.draw.empty()) throw config.error("draw", "is empty, expected names of measurements");
}

void check_criteria(const FigureChart& chart, const std::vector<Criterion>& criteria,
                    const Config& config) {
  for (const std::string& name : chart.criteria) {
    const auto found = std::find_if(criteria.begin(), criteria.end(),
                                    [&name](const Criterion& c) { return c.name == name; });
    if (found == criteria.end()) {
      std::string known;
      for (const Criterion& c : criteria) known += (known.empty() ? "" : ", ") + c.name;
      throw config.error("criteria", "found '" + name + "', expected one of: " + known);
    }
    if (found->measurement->dimension != chart.dimension()) {
      throw config.error("criteria",
                         "'" + name + "' has another unit than '" + chart.draw.front() + "'");
    }
  }
}

FigureChart read_chart(Config& config, const std::vector<Criterion>& criteria) {
  FigureChart chart;
  chart.line = config.line();
  chart.draw = config.texts("draw");
  if (config.has("statistic")) {
    chart.statistic = statistic_named(config.choice("statistic", statistic_names()));
    chart.phases = config.texts("phases");
    if (chart.phases.empty()) throw config.error("phases", "is empty, expected names of phases");
  } else {
    chart.phases = {whole_run};
    config.optional("phase", chart.phases.front());
    chart.by_sample = config.has("over") && config.choice("over", {"time", "sample"}) == "sample";
  }
  check_draw(chart, config);
  for (const std::string& name : chart.draw) {
    chart.title += (chart.title.empty() ? "" : ", ") + name;
  }
  if (chart.statistic) chart.title = name_of(*chart.statistic) + " " + chart.title;
  config.optional("title", chart.title);
  if (config.has("criteria")) chart.criteria = config.texts("criteria");
  check_criteria(chart, criteria, config);
  if (config.has("levels")) {
    Config levels = config.section("levels");
    for (const std::string& name : levels.keys()) {
      chart.levels.emplace_back(name, levels.quantity(name, chart.dimension()));
    }
  }
  config.finish();
  return chart;
}

}  // namespace

std::optional<std::size_t> coordinate_named(const std::string& name) {
  const auto* found = std::find(std::begin(coordinates), std::end(coordinates), name);
  if (found == std::end(coordinates)) return std::nullopt;
  return static_cast<std::size_t>(found - std::begin(coordinates));
}

berth::Dimension FigureChart::dimension() const { return *dimension_of(draw.front()); }

std::vector<Figure> read_figures(Config& procedure, const std::vector<Criterion>& criteria) {
  std::vector<Figure> figures;
  for (Config& config : procedure.sections("figures")) {
    Figure figure;
    figure.line = config.line();
    figure.name = config.text("name");
    config.optional("caption", figure.caption);
    for (Config& chart : config.sections("charts")) {
      figure.charts.push_back(read_chart(chart, criteria));
    }
    config.finish();
    if (figure.charts.empty()) throw config.error("charts", "is missing");
    figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace berth::evaluation
