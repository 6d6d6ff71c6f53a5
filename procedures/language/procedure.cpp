// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/procedure.h"

#include <algorithm>

#include "common/core/config.h"
#include "common/core/file.h"

namespace berth::procedures {
namespace {

/// What every verb's reader gives: the verb and how long it may take when the step does not say.
struct Read {
  Verb verb;
  double timeout;
};

double positive(Config& config, const std::string& key, Dimension dimension) {
  const double value = config.quantity(key, dimension);
  if (value <= 0) throw config.error(key, "must be greater than zero");
  return value;
}

void optional_count(Config& config, const std::string& key, int& value) {
  config.optional(key, value);
  if (value < 0) throw config.error(key, "must not be negative");
}

double lamp(Config& config, const std::string& key) {
  double value = 0;
  config.optional(key, Dimension::number, value);
  if (value < 0 || value > 1) throw config.error(key, "expected 0 % to 100 %");
  return value;
}

Read read_lights(Config& step) {
  Config config = step.section("lights");
  Lights lights;
  lights.sun = lamp(config, "sun");
  lights.albedo = lamp(config, "albedo");
  config.optional("azimuth", Dimension::angle, lights.sun_azimuth);
  config.optional("elevation", Dimension::angle, lights.sun_elevation);
  config.finish();
  return {lights, 20};
}

Read read_move(Config& step) {
  Config config = step.section("move");
  Move move;
  move.to = config.pose("to");
  move.speed = positive(config, "speed", Dimension::speed);
  move.angular_speed = radians(10);
  config.optional("turn", Dimension::angular_speed, move.angular_speed);
  if (move.angular_speed <= 0) throw config.error("turn", "must be greater than zero");
  config.finish();
  return {move, 180};
}

Read read_trajectory(Config& step) {
  Config config = step.section("trajectory");
  Trajectory trajectory;
  for (Config& section : config.sections("waypoints")) {
    Trajectory::Waypoint waypoint;
    waypoint.at = section.quantity("at", Dimension::time);
    waypoint.pose = section.pose("pose");
    section.finish();
    if (!trajectory.waypoints.empty() && waypoint.at <= trajectory.waypoints.back().at) {
      throw section.error("at", "must be later than the waypoint before");
    }
    trajectory.waypoints.push_back(waypoint);
  }
  if (trajectory.waypoints.empty()) throw config.error("waypoints", "expected at least one");
  config.finish();
  return {trajectory, trajectory.waypoints.back().at + 120};
}

void optional_gate(Config& config, double& near, double& far) {
  if (!config.has("gate")) return;
  const auto gate = config.quantities("gate", Dimension::length);
  if (gate.size() != 2 || gate[0] < 0 || gate[1] <= gate[0]) {
    throw config.error("gate", "expected [near, far], such as [3 m, 8 m]");
  }
  near = gate[0];
  far = gate[1];
}

Read read_acquire(Config& step) {
  Config config = step.section("acquire");
  Acquire acquire;
  optional_gate(config, acquire.gate_near, acquire.gate_far);
  optional_count(config, "returns", acquire.returns);
  config.finish();
  return {acquire, 90};
}

Read read_track(Config& step) {
  Config config = step.section("track");
  Track track;
  optional_gate(config, track.gate_near, track.gate_far);
  config.optional("strategy", track.strategy);
  optional_count(config, "returns", track.returns);
  config.optional("settle", track.settle);
  if (track.settle < 1) throw config.error("settle", "expected at least one good estimate");
  config.finish();
  return {track, 60};
}

Read read_approach(Config& step) {
  Config config = step.section("approach");
  Approach approach;
  approach.standoff = positive(config, "standoff", Dimension::length);
  approach.speed = positive(config, "speed", Dimension::speed);
  config.optional("dock", approach.dock);
  config.finish();
  return {approach, 600};
}

double duration_of(Config& step, const std::string& verb) {
  return positive(step, verb, Dimension::time);
}

Read read_hold(Config& step) {
  const double duration = duration_of(step, "hold");
  return {Hold{duration, false}, duration + 30};
}

Read read_station_keep(Config& step) {
  const double duration = duration_of(step, "station_keep");
  return {Hold{duration, true}, duration + 30};
}

Read read_wait(Config& step) {
  const double duration = duration_of(step, "wait");
  return {Wait{duration}, duration + 30};
}

Read read_scan(Config& step) {
  Config config = step.section("scan");
  Scan scan;
  scan_window_t& window = scan.window;
  window.name = "procedure";
  config.optional("azimuth", Dimension::angle, window.azimuth_rad);
  config.optional("elevation", Dimension::angle, window.elevation_rad);
  window.width_rad = positive(config, "width", Dimension::angle);
  window.height_rad = positive(config, "height", Dimension::angle);
  window.count = static_cast<std::int32_t>(config.integer("count"));
  if (window.count < 1) throw config.error("count", "expected at least one beam");
  const std::vector<std::string> patterns = {"raster", "spiral", "rosette", "lissajous"};
  if (config.has("pattern")) {
    const auto found =
        std::find(patterns.begin(), patterns.end(), config.choice("pattern", patterns));
    window.pattern = static_cast<std::int8_t>(found - patterns.begin());
  }
  config.finish();
  return {scan, 120};
}

struct Reader {
  const char* verb;
  Read (*read)(Config& step);
};

Read read_annotate(Config& step) { return {Annotate{step.text("annotate")}, 10}; }

Read read_stop_tracking(Config& step) {
  if (!step.raw("stop_tracking").IsNull()) {
    throw step.error("stop_tracking", "expected nothing behind it");
  }
  return {StopTracking{}, 20};
}

constexpr Reader readers[] = {
    {"lights", read_lights},
    {"move", read_move},
    {"trajectory", read_trajectory},
    {"acquire", read_acquire},
    {"track", read_track},
    {"approach", read_approach},
    {"hold", read_hold},
    {"station_keep", read_station_keep},
    {"wait", read_wait},
    {"scan", read_scan},
    {"annotate", read_annotate},
    {"stop_tracking", read_stop_tracking},
};

const Reader* reader_of(const std::string& name) {
  const auto found = std::find_if(std::begin(readers), std::end(readers),
                                  [&name](const Reader& r) { return name == r.verb; });
  return found == std::end(readers) ? nullptr : found;
}

Step read_step(Config& config) {
  const Reader* reader = nullptr;
  std::string known;
  for (const Reader& r : readers) known += std::string(known.empty() ? "" : ", ") + r.verb;
  for (const std::string& key : config.keys()) {
    const Reader* found = reader_of(key);
    if (found == nullptr) {
      if (key == "name" || key == "phase" || key == "timeout") continue;
      throw config.error(key, "is no step; steps are: " + known);
    }
    if (reader != nullptr) {
      throw config.error(key, std::string("a step does one thing, and this one has '") +
                                  reader->verb + "' already");
    }
    reader = found;
  }
  if (reader == nullptr) {
    throw config.error(config.keys().front(), "this step does nothing; steps are: " + known);
  }
  Step step;
  step.line = config.line();
  step.name = reader->verb;
  step.phase = reader->verb;
  const Read read = reader->read(config);
  step.verb = read.verb;
  step.timeout = read.timeout;
  config.optional("name", step.name);
  config.optional("phase", step.phase);
  config.optional("timeout", Dimension::time, step.timeout);
  if (step.timeout <= 0) throw config.error("timeout", "must be greater than zero");
  if (step.phase == logs::whole_run || step.phase == logs::teardown_phase) {
    throw config.error("phase", "'" + step.phase + "' is a phase of every procedure's own");
  }
  config.finish();
  return step;
}

std::vector<Step> read_steps(Config& config, const std::string& key) {
  std::vector<Step> steps;
  for (Config& section : config.sections(key)) steps.push_back(read_step(section));
  return steps;
}

bool needs_tracking(const Step& step) {
  const auto* hold = std::get_if<Hold>(&step.verb);
  return std::holds_alternative<Approach>(step.verb) || std::holds_alternative<Track>(step.verb) ||
         (hold != nullptr && hold->closed_loop);
}

InputError error_at(const Procedure& procedure, int line, const std::string& what) {
  return InputError(procedure.file + ":" + std::to_string(line) + ": " + what);
}

void check_order(const Procedure& procedure) {
  bool tracking = false;
  for (const Step& step : procedure.steps) {
    if (std::holds_alternative<Acquire>(step.verb)) tracking = true;
    if (std::holds_alternative<StopTracking>(step.verb)) tracking = false;
    if (needs_tracking(step) && !tracking) {
      throw error_at(procedure, step.line, "step '" + step.name + "' needs an 'acquire' before it");
    }
  }
  for (const Step& step : procedure.teardown) {
    if (needs_tracking(step) || std::holds_alternative<Acquire>(step.verb)) {
      throw error_at(procedure, step.line,
                     "step '" + step.name + "' cannot be in the teardown, which must always work");
    }
  }
}

void check_phases(const Procedure& procedure) {
  std::string known = logs::whole_run;
  for (const Step& step : procedure.steps) known += ", " + step.phase;
  for (const logs::Criterion& criterion : procedure.criteria) {
    const auto same = [&criterion](const Step& s) { return s.phase == criterion.phase; };
    if (criterion.phase == logs::whole_run ||
        std::any_of(procedure.steps.begin(), procedure.steps.end(), same)) {
      continue;
    }
    throw error_at(procedure, criterion.line,
                   "key 'criteria': criterion '" + criterion.name + "': found phase '" +
                       criterion.phase + "', expected one of: " + known);
  }
}

}  // namespace

Procedure parse_procedure(const std::string& text, const std::string& file,
                          const Overrides& overrides) {
  Procedure procedure;
  procedure.file = file;
  procedure.text = apply_parameters(text, file, overrides);
  Config config = Config::parse(procedure.text, file);
  procedure.name = config.text("name");
  config.optional("description", procedure.description);
  config.optional("layout", procedure.layout);
  config.optional("target", procedure.target);
  config.optional("target_length", Dimension::length, procedure.target_length);
  if (config.has("parameters")) config.raw("parameters");  // read by apply_parameters
  if (config.has("limits")) {
    Config limits = config.section("limits");
    limits.optional("lost_for", Dimension::time, procedure.lost_for);
    if (procedure.lost_for <= 0) throw limits.error("lost_for", "must be greater than zero");
    limits.finish();
  }
  procedure.steps = read_steps(config, "steps");
  if (procedure.steps.empty()) throw config.error("steps", "expected at least one step");
  if (config.has("teardown")) {
    procedure.teardown = read_steps(config, "teardown");
  } else {
    procedure.teardown = {{StopTracking{}, "stop_tracking", "", 20, 0},
                          {Lights{}, "lights off", "", 20, 0}};
  }
  for (Step& step : procedure.teardown) step.phase = logs::teardown_phase;
  procedure.criteria = logs::read_criteria(config);
  config.finish();
  check_order(procedure);
  check_phases(procedure);
  return procedure;
}

Procedure load_procedure(const std::filesystem::path& file, const Overrides& overrides) {
  return parse_procedure(read_file(file), file.string(), overrides);
}

}  // namespace berth::procedures
