// SPDX-License-Identifier: BSD-3-Clause
#include "logs/measure/measurement.h"

#include "common/core/text.h"
#include "logs/measure/series.h"

namespace berth::logs {
namespace {

std::vector<Measurement> make_measurements() {
  std::vector<Measurement> table;
  add_errors(table);
  add_velocities(table);
  add_consistency(table);
  add_availability(table);
  add_scans(table);
  add_steps(table);
  add_timing(table);
  add_mount(table);
  add_following(table);
  add_approach(table);
  add_safety(table);
  return table;
}

}  // namespace

const std::vector<Measurement>& measurements() {
  static const std::vector<Measurement> table = make_measurements();
  return table;
}

const Measurement* measurement_named(const std::string& name) {
  for (const Measurement& measurement : measurements()) {
    if (measurement.name == name) return &measurement;
  }
  return nullptr;
}

std::string describe_measurements(bool markdown) {
  std::string text;
  std::string family;
  std::vector<std::vector<std::string>> lines;
  const auto end_family = [&] {
    text += text_table(lines, 4);
    lines.clear();
  };
  for (const Measurement& m : measurements()) {
    if (m.family != family) {
      family = m.family;
      if (markdown) {
        text += (text.empty() ? "" : "\n") + std::string("### ") + family + "\n\n" +
                "| measurement | unit | of | what it is |\n|---|---|---|---|\n";
      } else {
        end_family();
        text += (text.empty() ? "" : "\n") + family + "\n";
      }
    }
    const std::string of = m.series ? "series" : "number";
    if (markdown) {
      text += "| `" + m.name + "` | " + m.unit + " | " + of + " | " + m.description + " |\n";
    } else {
      lines.push_back({m.name, m.unit, of, m.description});
    }
  }
  if (markdown) return text;
  end_family();
  text += "\nstatistics of a series:";
  for (const std::string& name : statistic_names()) text += " " + name;
  return text + "\n";
}

}  // namespace berth::logs
