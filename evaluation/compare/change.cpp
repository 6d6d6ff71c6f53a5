// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/change.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "common/core/table.h"
#include "common/core/text.h"
#include "lcmtypes/words.h"

namespace berth::evaluation {
namespace {

bool is_share_of_runs(const std::string& measurement) {
  return measurement == passed_measurement || measurement == completed_measurement;
}

/// The returns on which an estimate rests.
using Returns = std::pair<std::int64_t, std::int32_t>;
using ValueOf = std::map<Returns, double>;

struct Compared {
  const char* measurement;
  Statistic statistic;
};

constexpr Compared compared[] = {
    {"position_error", Statistic::rms}, {"position_error", Statistic::p95},
    {"attitude_error", Statistic::rms}, {"attitude_error", Statistic::p95},
    {"velocity_error", Statistic::rms}, {"angular_velocity_error", Statistic::rms},
    {"nees", Statistic::mean},
};

struct Side {
  explicit Side(const RunRecord& of) : record(of), measurer(of, {}) {
    for (const auto& e : record.estimates()) {
      returns_at[e.utime] = {e.scan_id, e.last_packet};
    }
  }

  ValueOf values(const Measurement& measurement, const Phase& phase) const {
    const Series series = measurement.series(measurer, phase);
    ValueOf values;
    for (std::size_t i = 0; i < series.utime.size(); ++i) {
      values[returns_at.at(series.utime[i])] = measurement.shown(series.value[i]);
    }
    return values;
  }

  /// Nothing when the run has no such phase. Without a procedure all of it is one.
  std::optional<Phase> phase(const std::string& name) const {
    if (record.state() || returns_at.empty()) return record.phase(name);
    if (name != whole_run) return std::nullopt;
    return Phase{name, {{returns_at.begin()->first, returns_at.rbegin()->first}}};
  }

  /// 100 for good estimates, 0 for others.
  ValueOf good(const Phase& phase) const {
    ValueOf values;
    for (const auto& e : record.estimates()) {
      if (phase.contains(e.utime)) values[{e.scan_id, e.last_packet}] = e.ok() ? 100 : 0;
    }
    return values;
  }

  const RunRecord& record;
  Measurer measurer;
  std::map<Utime, Returns> returns_at;
};

struct TwoSides {
  explicit TwoSides(const RecordPair& pair) : before(*pair.before), after(*pair.after) {}
  Side before;
  Side after;
};

/// Values of the same returns, one after the other.
struct PairedValues {
  std::vector<double> before;
  std::vector<double> after;

  void add(double b, double a) {
    before.push_back(b);
    after.push_back(a);
  }
  void add_common(const ValueOf& b, const ValueOf& a) {
    for (const auto& [returns, value] : b) {
      if (const auto other = a.find(returns); other != a.end()) add(value, other->second);
    }
  }
  /// An estimate that is not there is not good.
  void add_all(const ValueOf& b, const ValueOf& a) {
    std::map<Returns, std::pair<double, double>> all;
    for (const auto& [returns, value] : b) all[returns].first = value;
    for (const auto& [returns, value] : a) all[returns].second = value;
    for (const auto& [returns, values] : all) add(values.first, values.second);
  }
};

std::vector<std::string> phases_of(const std::vector<TwoSides>& runs) {
  std::vector<std::string> names;
  for (const TwoSides& run : runs) {
    for (const Phase& phase : run.before.record.phases()) {
      if (phase.name != teardown_phase && phase.name != whole_run &&
          std::find(names.begin(), names.end(), phase.name) == names.end()) {
        names.push_back(phase.name);
      }
    }
  }
  if (names.size() != 1) names.push_back(whole_run);
  return names;
}

ChangeRow row_of(const std::string& phase, const std::string& measurement, Statistic statistic,
                 const std::string& unit, const PairedValues& paired, double level) {
  BootstrapOptions options;
  options.confidence = 1 - level;
  // Errors of one run are correlated. Whether a scan gives a good estimate depends on that scan
  // alone: a target lost for a minute is no single event.
  options.block = measurement == good_estimates_measurement ? 1 : 0;
  ChangeRow row;
  row.phase = phase;
  row.measurement = measurement;
  row.statistic = name_of(statistic);
  row.unit = unit;
  row.difference = paired_difference(statistic, paired.before, paired.after, options);
  const bool same = row.difference.low == 0 && row.difference.high == 0;
  row.judgement = same ? Judgement::same : Judgement::no_difference;
  return row;
}

void add_phase(const std::string& name, const std::vector<TwoSides>& runs, double level,
               std::vector<ChangeRow>& rows) {
  const auto over_runs = [&](const auto& add) {
    PairedValues paired;
    for (const TwoSides& run : runs) {
      if (const auto phase = run.before.phase(name)) add(run, *phase, paired);
    }
    return paired;
  };
  for (const auto& [measurement_name, statistic] : compared) {
    const Measurement& measurement = *measurement_named(measurement_name);
    const PairedValues paired = over_runs([&](const TwoSides& run, const Phase& phase,
                                              PairedValues& into) {
      into.add_common(run.before.values(measurement, phase), run.after.values(measurement, phase));
    });
    if (paired.before.empty()) continue;
    rows.push_back(row_of(name, measurement.name, statistic, measurement.unit, paired, level));
  }
  const PairedValues good =
      over_runs([](const TwoSides& run, const Phase& phase, PairedValues& into) {
        into.add_all(run.before.good(phase), run.after.good(phase));
      });
  if (good.before.empty()) return;
  rows.push_back(row_of(name, good_estimates_measurement, Statistic::mean, "%", good, level));
}

bool is_better(const ChangeRow& row) {
  return kind_of_change(row.measurement, row.statistic, row.difference.before,
                        row.difference.after) == ChangeKind::better;
}

/// A row without a test does not raise the p-values of the others.
bool is_tested(const ChangeRow& row) {
  constexpr double min_independent = 5;
  return row.judgement != Judgement::same && row.difference.independent() >= min_independent;
}

void judge(std::vector<ChangeRow>& rows, double level) {
  std::vector<double> p_values;
  for (const ChangeRow& row : rows) {
    p_values.push_back(is_tested(row) ? row.difference.p_value
                                      : std::numeric_limits<double>::quiet_NaN());
  }
  const std::vector<double> adjusted = holm(p_values);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ChangeRow& row = rows[i];
    row.adjusted_p = adjusted[i];
    if (row.judgement == Judgement::same) continue;
    if (!is_tested(row)) {
      row.judgement = Judgement::too_few;
    } else if (adjusted[i] < level) {
      row.judgement = is_better(row) ? Judgement::better : Judgement::worse;
    } else if (row.difference.significant(level)) {
      row.judgement = is_better(row) ? Judgement::perhaps_better : Judgement::perhaps_worse;
    }
  }
}

void count_statuses(const TwoSides& run, StatusChanges& changes) {
  std::map<Returns, std::pair<std::string, std::string>> all;
  for (const auto& e : run.before.record.estimates()) {
    all[{e.scan_id, e.last_packet}] = {words::of_estimate_status(e.status), "none"};
  }
  for (const auto& e : run.after.record.estimates()) {
    auto& both = all[{e.scan_id, e.last_packet}];
    if (both.first.empty()) both.first = "none";
    both.second = words::of_estimate_status(e.status);
  }
  for (const auto& [returns, both] : all) ++changes[both];
}

}  // namespace

double MinimumEffect::of(const std::string& measurement, double before) const {
  if (is_share_of_runs(measurement)) return std::max(1e-9, relative * before);
  const Measurement* what = measurement_named(measurement);
  const double fixed = what == nullptr ? 0 : absolute.at(what->dimension) / what->unit_si;
  return std::max(fixed, relative * before);
}

ChangeKind kind_of_change(const std::string& measurement, const std::string& statistic,
                          double before, double after, const std::vector<Criterion>& criteria) {
  if (is_share_of_runs(measurement) || measurement == good_estimates_measurement) {
    return Preference{Direction::larger_is_better}.kind_of_change(before, after);
  }
  for (const Criterion& criterion : criteria) {
    if (criterion.name == statistic && criterion.measurement->name == measurement) {
      return kind_of_change(criterion, before, after);
    }
  }
  const Measurement* what = measurement_named(measurement);
  if (what == nullptr) return ChangeKind::changed;  // of another version
  return what->preference(statistic_named(statistic).value_or(Statistic::mean))
      .kind_of_change(before, after);
}

const char* name_of(ChangeKind kind) {
  constexpr const char* names[] = {"better", "worse", "changed"};
  return names[static_cast<int>(kind)];
}

const char* text_of(Judgement judgement) {
  constexpr const char* texts[] = {"same",   "no difference", "perhaps better", "perhaps worse",
                                   "better", "worse",         "too few"};
  return texts[static_cast<int>(judgement)];
}

bool Change::any(Judgement judgement) const {
  return std::any_of(rows.begin(), rows.end(),
                     [judgement](const ChangeRow& row) { return row.judgement == judgement; });
}

std::string Change::verdict() const {
  const bool better = any(Judgement::better);
  const bool worse = any(Judgement::worse);
  if (better && worse) return "mixed";
  return better ? "better" : worse ? "worse" : "no difference";
}

Change find_change(const std::vector<RecordPair>& pairs, double level) {
  const std::vector<TwoSides> runs(pairs.begin(), pairs.end());
  Change change;
  change.runs = runs.size();
  for (const std::string& phase : phases_of(runs)) add_phase(phase, runs, level, change.rows);
  judge(change.rows, level);
  for (const TwoSides& run : runs) count_statuses(run, change.statuses);
  return change;
}

namespace {

/// Four significant digits.
std::string number(double value, bool with_sign = false) {
  if (std::isnan(value)) return "-";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  const double size = std::abs(value);
  const int decimals = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : size >= 1 ? 3 : 4;
  return (with_sign && value > 0 ? "+" : "") + fixed(value, decimals);
}

std::string p_text(double p) {
  if (std::isnan(p)) return "-";
  return p < 0.0001 ? "<0.0001" : fixed(p, 4);
}

Table::Row cells_of(const ChangeRow& row) {
  const PairedDifference& d = row.difference;
  return {row.phase,
          row.measurement + " " + row.statistic,
          row.unit,
          d.pairs,
          number(d.before),
          number(d.after),
          number(d.difference, true),
          "[" + number(d.low, true) + ", " + number(d.high, true) + "]",
          p_text(row.adjusted_p),
          text_of(row.judgement)};
}

Table status_table(const StatusChanges& statuses) {
  Table table{"ll", {"recorded", "again", "estimates"}};
  for (const auto& [status, count] : statuses) {
    table.rows.push_back({status.first, status.second, count});
  }
  return table;
}

}  // namespace

std::string text_of(const Change& change, double level) {
  Table table{"lllrrrrlrl",
              {"phase", "measurement", "unit", "pairs", "recorded", "again", "change",
               "[" + fixed(100 * (1 - level), 0) + " % interval]", "p", "judgement"}};
  std::string phase;
  for (const ChangeRow& row : change.rows) {
    if (!phase.empty() && row.phase != phase) table.rows.emplace_back();
    phase = row.phase;
    table.rows.push_back(cells_of(row));
  }
  return text_table(table) + "\nstatus:\n" + text_table(status_table(change.statuses)) +
         "\nagainst truth: " + change.verdict() + "\n";
}

nlohmann::ordered_json json_of(const Change& change) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const ChangeRow& row : change.rows) {
    const PairedDifference& d = row.difference;
    rows.push_back({{"phase", row.phase},
                    {"measurement", row.measurement},
                    {"statistic", row.statistic},
                    {"unit", row.unit},
                    {"pairs", d.pairs},
                    {"recorded", d.before},
                    {"again", d.after},
                    {"difference", d.difference},
                    {"interval", {d.low, d.high}},
                    {"block", d.block},
                    {"p", d.p_value},
                    {"p_adjusted", row.adjusted_p},
                    {"judgement", text_of(row.judgement)}});
  }
  return {{"runs", change.runs},
          {"verdict", change.verdict()},
          {"rows", rows},
          {"statuses", json_table(status_table(change.statuses))}};
}

}  // namespace berth::evaluation
