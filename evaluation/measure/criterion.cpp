// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/criterion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace berth::evaluation {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::vector<std::string> measurement_names() {
  std::vector<std::string> names;
  for (const Measurement& measurement : measurements()) names.push_back(measurement.name);
  return names;
}

Criterion read_criterion(Config& config) {
  Criterion criterion;
  criterion.line = config.line();
  criterion.lower = -infinity;
  criterion.upper = infinity;
  criterion.name = config.text("name");
  criterion.measurement = measurement_named(config.choice("measurement", measurement_names()));
  if (criterion.measurement->series) {
    criterion.statistic = *statistic_named(config.choice("statistic", statistic_names()));
  } else if (config.has("statistic")) {
    throw config.error("statistic", "is not for '" + criterion.measurement->name +
                                        "', which is one number and not a series");
  }
  const Dimension dimension = criterion.measurement->dimension;
  config.optional("phase", criterion.phase);
  config.optional("min", dimension, criterion.lower);
  config.optional("max", dimension, criterion.upper);
  config.optional("nominal", dimension, criterion.nominal);
  config.optional("samples", criterion.samples, at_least(1));
  config.optional("claim", criterion.claim);
  config.finish();
  if (!config.has("min") && !config.has("max")) {
    throw config.error("name", "criterion '" + criterion.name + "' needs 'min' or 'max'");
  }
  if (criterion.lower > criterion.upper) throw config.error("min", "is greater than 'max'");
  return criterion;
}

}  // namespace

std::vector<Criterion> read_criteria(Config& procedure) {
  std::vector<Criterion> criteria;
  for (Config& section : procedure.sections("criteria")) {
    criteria.push_back(read_criterion(section));
    const auto& name = criteria.back().name;
    const auto same = [&name](const Criterion& c) { return c.name == name; };
    if (std::any_of(criteria.begin(), std::prev(criteria.end()), same)) {
      throw section.error("name", "there is another criterion named '" + name + "'");
    }
  }
  return criteria;
}

criterion_result_t judge(const Criterion& criterion, const Measurer& measurer) {
  const Measurement& what = *criterion.measurement;
  criterion_result_t result{};
  result.name = criterion.name;
  result.measurement = what.series ? name_of(criterion.statistic) + " " + what.name : what.name;
  result.phase = criterion.phase;
  result.unit = what.unit;
  result.lower_limit = what.shown(criterion.lower);
  result.upper_limit = what.shown(criterion.upper);
  result.value = std::numeric_limits<double>::quiet_NaN();
  result.result = criterion_result_t::INCONCLUSIVE;

  const auto phase = measurer.record().phase(criterion.phase);
  if (!phase) {
    result.reason = "phase '" + criterion.phase + "' did not run";
    return result;
  }
  const Measured measured = measurer.measure(what, criterion.statistic, *phase);
  result.samples = measured.samples;
  result.reason = measured.reason;
  if (std::isnan(measured.value)) return result;

  const double value = measured.value - criterion.nominal;
  result.value = what.shown(value);
  result.uncertainty = what.shown(measured.uncertainty);
  const double band = 2 * measured.uncertainty;
  if (measured.samples < criterion.samples) {
    result.reason = std::to_string(measured.samples) + " samples, " +
                    std::to_string(criterion.samples) + " needed";
  } else if (value - band > criterion.upper || value + band < criterion.lower) {
    result.result = criterion_result_t::FAILED;
  } else if (value + band > criterion.upper || value - band < criterion.lower) {
    result.reason = "within truth's own uncertainty of the limit";
  } else if (!std::isnan(band)) {
    result.result = criterion_result_t::PASSED;
  }
  return result;
}

std::vector<criterion_result_t> judge(const std::vector<Criterion>& criteria,
                                      const Measurer& measurer) {
  std::vector<criterion_result_t> results;
  for (const Criterion& criterion : criteria) results.push_back(judge(criterion, measurer));
  return results;
}

ChangeKind kind_of_change(const Criterion& criterion, double before, double after) {
  const Measurement& what = *criterion.measurement;
  Preference preference = what.preference(criterion.statistic);
  if (preference.direction != Direction::neither) {
    preference.ideal -= what.shown(criterion.nominal);
    return preference.kind_of_change(before, after);
  }
  const auto margin_of = [&](double value) {
    return std::min(value - what.shown(criterion.lower), what.shown(criterion.upper) - value);
  };
  return Preference{Direction::larger_is_better}.kind_of_change(margin_of(before),
                                                                margin_of(after));
}

double margin(const criterion_result_t& result) {
  return std::min(result.value - result.lower_limit, result.upper_limit - result.value);
}

}  // namespace berth::evaluation
