// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/vocabulary.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "app/runs/config_override.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "evaluation/run/run_record.h"
#include "procedures/language/procedure.h"

namespace berth::campaigns {
namespace {

/// "p95 position_error in hold". @throws InputError.
KeptMeasurement measurement_of_run(const std::string& text,
                                   const std::vector<std::string>& phases) {
  KeptMeasurement kept;
  kept.name = text;
  kept.phase = evaluation::whole_run;
  std::string words = text;
  if (const auto in = text.find(" in "); in != std::string::npos) {
    kept.phase = text.substr(in + 4);
    words = text.substr(0, in);
    if (std::find(phases.begin(), phases.end(), kept.phase) == phases.end()) {
      throw InputError("found phase '" + kept.phase + "', expected one of: " + joined(phases));
    }
  }
  const auto space = words.rfind(' ');
  kept.measurement =
      evaluation::measurement_named(space == std::string::npos ? words : words.substr(space + 1));
  if (kept.measurement == nullptr) {
    throw InputError(
        "no such measurement, expected [STATISTIC] MEASUREMENT [in PHASE]; see "
        "berth compare --list");
  }
  kept.unit = kept.measurement->unit;
  if (space == std::string::npos) return kept;
  const auto statistic = evaluation::statistic_named(words.substr(0, space));
  if (!statistic || !kept.measurement->series) {
    throw InputError("found '" + words.substr(0, space) + "', expected " +
                     (kept.measurement->series ? "one of: " + joined(evaluation::statistic_names())
                                               : "no statistic: it is one number"));
  }
  kept.statistic = *statistic;
  return kept;
}

class ProcedureVocabulary : public Vocabulary {
 public:
  explicit ProcedureVocabulary(Places places)
      : places_(std::move(places)), procedure_(procedures::load_procedure(places_.procedure)) {}

  void check(const std::string& name, const std::string& value) const override {
    if (names_configuration(name)) {
      check_override(places_.config, name, value);
    } else {
      procedures::load_procedure(places_.procedure, {{name, value}});
    }
  }

  std::vector<std::string> required() const override { return {}; }

  KeptMeasurement measurement(const std::string& text) const override {
    return measurement_of_run(text, phases());
  }

 private:
  std::vector<std::string> phases() const {
    std::vector<std::string> names = {evaluation::whole_run};
    for (const auto& step : procedure_.steps) {
      if (std::find(names.begin(), names.end(), step.phase) == names.end()) {
        names.push_back(step.phase);
      }
    }
    return names;
  }

  Places places_;
  procedures::Procedure procedure_;
};

using Set = std::function<void(AcquisitionParameters&, double)>;

/// A parameter that is one quantity.
struct Known {
  const char* name;
  Dimension dimension;
  double min;
  double max;
  const char* default_value;
  const char* description;
  Set set;
};

const std::vector<Known>& known_parameters() {
  using P = AcquisitionParameters;
  static const std::vector<Known> known = {
      {"returns", Dimension::number, 1, 1e6, "", "beams that return from the target, about",
       [](P& p, double v) { p.scene.returns = static_cast<int>(std::lround(v)); }},
      {"range", Dimension::length, 0.1, 1000, "5 m", "of the target's middle, along the boresight",
       [](P& p, double v) { p.scene.middle.z() = v; }},
      {"right", Dimension::length, -100, 100, "0 m", "of the boresight is the target's middle",
       [](P& p, double v) { p.scene.middle.x() = v; }},
      {"down", Dimension::length, -100, 100, "0 m", "from the boresight is the target's middle",
       [](P& p, double v) { p.scene.middle.y() = v; }},
      {"range_noise", Dimension::length, 0, 1, "10 mm", "1 sigma of a range",
       [](P& p, double v) { p.scene.physics.noise.range_sigma_m = v; }},
      {"angle_noise", Dimension::angle, 0, 0.1, "0.1 mrad",
       "1 sigma of azimuth and elevation of a beam",
       [](P& p, double v) {
         p.scene.physics.noise.azimuth_sigma_rad = p.scene.physics.noise.elevation_sigma_rad = v;
       }},
      {"range_min", Dimension::length, 0, 100, "1 m", "the LIDAR's nearest range",
       [](P& p, double v) { p.scene.physics.noise.range_min_m = v; }},
      {"mixed_pixels", Dimension::number, 0, 1, "0", "1: a beam's footprint may meet two surfaces",
       [](P& p, double v) { p.scene.physics.scanner.footprint = v > 0.5; }},
      {"outliers", Dimension::number, 0, 1, "0 %", "share of the beams with a range of nothing",
       [](P& p, double v) { p.scene.physics.scanner.outliers = v; }},
      {"drop_outs", Dimension::number, 0, 1, "0 %",
       "share of the returns lost at normal incidence; ten times as many at 80 deg",
       [](P& p, double v) {
         p.scene.physics.scanner.drop_out = v;
         p.scene.physics.scanner.drop_out_grazing = std::min(1.0, 10 * v);
       }},
      {"clutter", Dimension::number, 0, 1, "0 %", "share of the returns from scattered points",
       [](P& p, double v) { p.scene.physics.clutter = v; }},
      {"plate", Dimension::number, 0, 1, "0",
       "1: something else in the window takes a fifth of the returns",
       [](P& p, double v) { p.scene.plate = v > 0.5; }},
      {"mesh_error", Dimension::length, 0, 1, "0 mm",
       "1 sigma of the true surface about the model's, alike over 0.3 m",
       [](P& p, double v) { p.scene.physics.mesh_sigma_m = v; }},
      {"gate_near", Dimension::length, 0, 1000, "1 m", "of the range gate",
       [](P& p, double v) { p.gate_near_m = v; }},
      {"gate_far", Dimension::length, 0, 1000, "15 m", "of the range gate",
       [](P& p, double v) { p.gate_far_m = v; }},
  };
  return known;
}

constexpr char attitude_description[] =
    "[w, p, r] of the target in the sensor frame, degrees; or 'any attitude'";

std::vector<double> list_of(const std::string& value) {
  YamlNode map(YamlNode::Kind::map);
  map.put("value", read_yaml(value, "value"));
  return Config(map, "value").quantities("value", Dimension::number);
}

/// Only what the estimator reads: there is no cell.
constexpr char estimator_file[] = "estimator.yaml:";

class AcquisitionVocabulary : public Vocabulary {
 public:
  explicit AcquisitionVocabulary(Places places) : places_(std::move(places)) {}

  void check(const std::string& name, const std::string& value) const override {
    if (names_configuration(name)) {
      if (name.rfind(estimator_file, 0) != 0) {
        throw InputError("an acquisition reads no other file of config/ than estimator.yaml");
      }
      check_override(places_.config, name, value);
      return;
    }
    AcquisitionParameters parameters;
    set_parameter(parameters, name, value);
  }

  std::vector<std::string> required() const override { return {"returns", "attitude"}; }

  KeptMeasurement measurement(const std::string& text) const override {
    for (const AcquisitionMeasurement& known : acquisition_measurements()) {
      if (text != known.name) continue;
      KeptMeasurement kept;
      kept.name = text;
      kept.unit = known.unit;
      return kept;
    }
    std::string names;
    for (const AcquisitionMeasurement& known : acquisition_measurements()) {
      names += std::string(names.empty() ? "" : ", ") + known.name;
    }
    throw InputError("no measurement of an acquisition, expected one of: " + names);
  }

 private:
  Places places_;
};

}  // namespace

std::unique_ptr<Vocabulary> vocabulary_of_procedure(const Places& places) {
  return std::make_unique<ProcedureVocabulary>(places);
}

void set_parameter(AcquisitionParameters& parameters, const std::string& name,
                   const std::string& value) {
  if (name == "attitude") {
    const auto angles = list_of(value);
    if (angles.size() != 3) {
      throw InputError("found '" + value + "', expected " + attitude_description);
    }
    parameters.scene.attitude =
        pose_from_xyzwpr({0, 0, 0, angles[0], angles[1], angles[2]}).rotation;
    return;
  }
  std::string names = "attitude";
  for (const Known& known : known_parameters()) {
    names += std::string(", ") + known.name;
    if (name != known.name) continue;
    const double number = parse_quantity(value, known.dimension);
    if (!(number >= known.min && number <= known.max)) {
      throw InputError("found '" + value + "', which is out of the limits of '" + name + "'");
    }
    known.set(parameters, number);
    return;
  }
  throw InputError("no parameter of an acquisition, expected one of: " + names);
}

const std::vector<AcquisitionMeasurement>& acquisition_measurements() {
  static const std::vector<AcquisitionMeasurement> known = {
      {"position_error", "mm", "distance between estimated and true position"},
      {"x_error", "mm", "estimated minus true x (right)"},
      {"y_error", "mm", "estimated minus true y (down)"},
      {"z_error", "mm", "estimated minus true z (along the boresight)"},
      {"attitude_error", "deg", "angle between estimated and true attitude"},
      {"attitude_x_error", "deg", "attitude error about x"},
      {"attitude_y_error", "deg", "attitude error about y"},
      {"attitude_z_error", "deg", "attitude error about z"},
      {"roll_error", "deg", "size of the attitude error about the model's x"},
      {"pitch_error", "deg", "size of the attitude error about the model's y"},
      {"yaw_error", "deg", "size of the attitude error about the model's z"},
      {"points", "", "returns that the estimator was given, range gate passed"},
      {"hypotheses", "", "poses that it left open"},
      {"probability", "", "that it gave to the best one"},
  };
  return known;
}

std::string describe_acquisition() {
  Table parameters{"lll", {"parameter", "otherwise", "what it is"}};
  parameters.rows.push_back({"`attitude`", "", attitude_description});
  for (const Known& known : known_parameters()) {
    parameters.rows.push_back(
        {std::string("`") + known.name + "`", known.default_value, known.description});
  }
  Table measurements{"lll", {"measurement", "unit", "what it is"}};
  for (const AcquisitionMeasurement& known : acquisition_measurements()) {
    measurements.rows.push_back(
        {std::string("`") + known.name + "`", known.unit, known.description});
  }
  return markdown_table(parameters) + "\n" + markdown_table(measurements);
}

std::unique_ptr<Vocabulary> vocabulary_of_acquisition(const Places& places) {
  return std::make_unique<AcquisitionVocabulary>(places);
}

}  // namespace berth::campaigns
