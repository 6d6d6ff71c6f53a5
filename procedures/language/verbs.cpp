// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/verbs.h"

#include <algorithm>
#include <stdexcept>

#include "procedures/language/parameters.h"
#include "procedures/language/step_options.h"

namespace berth::procedures {
namespace {

const std::vector<std::string> patterns = {"raster", "spiral", "rosette", "lissajous"};

double positive(Config& config, const std::string& key, Dimension dimension) {
  const double value = config.quantity(key, dimension);
  if (value <= 0) throw config.error(key, "must be greater than zero");
  return value;
}

void optional_count(Config& config, const std::string& key, int& value) {
  config.optional(key, value);
  if (value < 0) throw config.error(key, "must not be negative");
}

void read_lamp(Config& config, const std::string& key, double& value) {
  config.optional(key, Dimension::number, value);
  if (value < 0 || value > 1) throw config.error(key, "expected 0 % to 100 %");
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

Read read_lights(Config& config) { return {read_lamps(config, {}), 20}; }

Read read_move(Config& config) {
  Move move;
  move.to = config.pose("to");
  move.speed = positive(config, "speed", Dimension::speed);
  move.angular_speed = radians(10);
  config.optional("turn", Dimension::angular_speed, move.angular_speed);
  if (move.angular_speed <= 0) throw config.error("turn", "must be greater than zero");
  if (config.has("frozen")) {
    move.frozen_arm = frozen_arm_of(config.choice("frozen", frozen_arms()));
  }
  return {move, 180};
}

Read read_trajectory_step(Config& step) {
  Trajectory trajectory = read_trajectory(step);
  const double timeout = trajectory.duration > 0 ? trajectory.duration + 120 : 600;
  return {std::move(trajectory), timeout};
}

Read read_acquire(Config& config) {
  Acquire acquire;
  optional_gate(config, acquire.gate_near, acquire.gate_far);
  optional_count(config, "returns", acquire.returns);
  return {acquire, 90};
}

Read read_track(Config& config) {
  Track track;
  optional_gate(config, track.gate_near, track.gate_far);
  config.optional("strategy", track.strategy);
  optional_count(config, "returns", track.returns);
  config.optional("settle", track.settle);
  if (track.settle < 1) throw config.error("settle", "expected at least one good estimate");
  if (config.has("from")) track.from = config.pose("from");
  return {track, 60};
}

void optional_target_motion(Config& config, std::optional<Trajectory>& motion) {
  if (config.has("target_motion")) motion = read_trajectory(config, "target_motion");
}

ClosedLoop read_loop(Config& config) {
  ClosedLoop loop;
  config.optional("guidance", loop.guidance);
  optional_target_motion(config, loop.target_motion);
  return loop;
}

Read read_approach(Config& config) {
  Approach approach;
  approach.standoff = positive(config, "standoff", Dimension::length);
  approach.speed = positive(config, "speed", Dimension::speed);
  config.optional("dock", approach.dock);
  approach.loop = read_loop(config);
  return {approach, 600};
}

Read read_hold(Config& step) {
  const double duration = positive(step, "hold", Dimension::time);
  return {Hold{duration, false, {}}, duration + 30};
}

Read read_station_keep(Config& step) {
  const double duration = positive(step, "station_keep", Dimension::time);
  return {Hold{duration, true, {}}, duration + 30};
}

Read read_station_keep_map(Config& config) {
  const double duration = positive(config, "for", Dimension::time);
  return {Hold{duration, true, read_loop(config)}, duration + 30};
}

Read read_guided(Config& config) {
  Guided guided;
  guided.by = config.text("by");
  guided.duration = positive(config, "for", Dimension::time);
  guided.speed = positive(config, "speed", Dimension::speed);
  guided.angular_speed = radians(5);
  config.optional("turn", Dimension::angular_speed, guided.angular_speed);
  if (guided.angular_speed <= 0) throw config.error("turn", "must be greater than zero");
  if (config.has("until")) {
    try {
      guided.until = parse_condition(config.text("until"));
    } catch (const InputError& e) {
      throw config.error("until", e.what());
    }
  }
  optional_target_motion(config, guided.target_motion);
  const double timeout = guided.duration + 30;
  return {std::move(guided), timeout};
}

Read read_wait(Config& step) {
  const double duration = positive(step, "wait", Dimension::time);
  return {Wait{duration}, duration + 30};
}

Read read_wait_until(Config& step) {
  try {
    return {WaitUntil{parse_condition(step.text("wait_until"))}, 60};
  } catch (const InputError& e) {
    throw step.error("wait_until", e.what());
  }
}

Read read_scan(Config& config) {
  Scan scan;
  scan_window_t& window = scan.window;
  window.name = "procedure";
  config.optional("azimuth", Dimension::angle, window.azimuth_rad);
  config.optional("elevation", Dimension::angle, window.elevation_rad);
  window.width_rad = positive(config, "width", Dimension::angle);
  window.height_rad = positive(config, "height", Dimension::angle);
  window.count = static_cast<std::int32_t>(config.integer("count"));
  if (window.count < 1) throw config.error("count", "expected at least one beam");
  if (config.has("pattern")) {
    const auto found =
        std::find(patterns.begin(), patterns.end(), config.choice("pattern", patterns));
    window.pattern = static_cast<std::int8_t>(found - patterns.begin());
  }
  return {scan, 120};
}

constexpr double prompt_timeout = 600;

Read read_prompt_text(Config& step) {
  return {Prompt{step.text("prompt"), {}, {}, ""}, prompt_timeout};
}

Read read_prompt(Config& config) {
  Prompt prompt;
  prompt.text = config.text("text");
  if (config.has("choices")) prompt.choices = config.texts("choices");
  if (config.has("go_on")) prompt.go_on = config.texts("go_on");
  config.optional("default", prompt.standard);
  const auto among_choices = [&](const std::string& key, const std::string& answer) {
    const auto& known = prompt.choices;
    if (known.empty() || std::find(known.begin(), known.end(), answer) != known.end()) return;
    throw config.error(key, "found '" + answer + "', expected one of the choices");
  };
  for (const std::string& answer : prompt.go_on) among_choices("go_on", answer);
  if (!prompt.standard.empty()) among_choices("default", prompt.standard);
  return {std::move(prompt), prompt_timeout};
}

Read read_annotate(Config& step) { return {Annotate{step.text("annotate")}, 10}; }

Record record_of(Config& config, const std::string& key) {
  const std::string name = config.text(key);
  const LiveQuantity* quantity = live_quantity_named(name);
  if (quantity == nullptr) throw config.error(key, unknown_live_quantity(name));
  return {name, quantity};
}

Read read_record_value(Config& step) { return {record_of(step, "record"), 10}; }

Read read_record(Config& config) {
  Record record = record_of(config, "value");
  config.optional("name", record.name);
  return {std::move(record), 10};
}

Read read_inject(Config& config) {
  Inject inject;
  inject.device = config.text("device");
  inject.fault = config.text("fault");
  if (config.has("value")) {
    const std::string value = config.text("value");
    const auto dimension = dimension_of(value);
    if (!dimension) throw config.error("value", "found '" + value + "', expected a quantity");
    inject.value = parse_quantity(value, *dimension);
  }
  config.optional("for", Dimension::time, inject.duration);
  if (inject.duration < 0) throw config.error("for", "must not be negative");
  config.optional("after", Dimension::time, inject.after);
  if (inject.after < 0) throw config.error("after", "must not be negative");
  return {inject, 15};
}

Read read_clear_injections(Config& config) {
  ClearInjections clear;
  clear.device = config.text("device");
  config.optional("fault", clear.fault);
  return {clear, 15};
}

void expect_nothing(Config& step, const std::string& verb) {
  if (!step.raw(verb).IsNull()) throw step.error(verb, "expected nothing behind it");
}

Read read_clear_all(Config& step) {
  expect_nothing(step, "clear_injections");
  return {ClearInjections{}, 15};
}

Read read_stop_tracking(Config& step) {
  expect_nothing(step, "stop_tracking");
  return {StopTracking{}, 20};
}

const KeyInfo gate_key = {"gate", Kind::gate, false, "the estimator's own",
                          "range gate, such as [3 m, 8 m]"};
const KeyInfo returns_key = {"returns", Kind::count, false, "the estimator's own choice",
                             "returns asked for in each scan"};
const KeyInfo acquire_returns_key = {"returns", Kind::count, false, "as they come",
                                     "returns wanted of the scan in which it is found"};

const KeyInfo guidance_key = {"guidance", Kind::text, false, "the testbed's own",
                              "profile of config/guidance, without its ending"};
const KeyInfo target_motion_key = {"target_motion", Kind::trajectory, false, "none",
                                   "the target's own motion meanwhile: a rule of trajectories, in "
                                   "the frame that the model has at the start"};

std::vector<VerbInfo> make_verbs() {
  return {
      {"lights",
       "sets the lamps; done when the facility reports them so",
       "20 s",
       {{"sun", Kind::number, false, "0 %", "sun lamp"},
        {"albedo", Kind::number, false, "0 %", "albedo lamp"},
        {"azimuth", Kind::angle, false, "0 deg", "of the sun lamp, cell frame"},
        {"elevation", Kind::angle, false, "0 deg", "of the sun lamp, cell frame"}},
       read_lights},
      {"move",
       "straight to a relative pose, open loop",
       "3 min",
       {{"to", Kind::pose, true, "", "pose of the target in the sensor frame"},
        {"speed", Kind::speed, true, "", "greatest relative speed"},
        {"turn", Kind::angular_speed, false, "10 deg/s", "greatest relative turn rate"},
        {"frozen", Kind::words, false, "none", "the arm that stands still", frozen_arms()}},
       read_move},
      {"trajectory", "along a path made by one of these rules, open loop", "its end and 2 min",
       trajectory_keys(), nullptr, std::nullopt, read_trajectory_step},
      {"scan",
       "one scan of the procedure's own; wants no tracking at the time",
       "2 min",
       {{"azimuth", Kind::angle, false, "0 deg", "of the window's middle, to the right"},
        {"elevation", Kind::angle, false, "0 deg", "of the window's middle, down"},
        {"width", Kind::angle, true, "", "full width"},
        {"height", Kind::angle, true, "", "full height"},
        {"count", Kind::count, true, "", "beams"},
        {"pattern", Kind::words, false, "raster", "path of the beam", patterns}},
       read_scan},
      {"acquire",
       "looks for the target; done with the first good estimate",
       "90 s",
       {gate_key, acquire_returns_key},
       read_acquire},
      {"track",
       "tracks on; done after some good estimates in a row",
       "60 s",
       {gate_key,
        returns_key,
        {"strategy", Kind::text, false, "the estimator's own", "where the LIDAR looks"},
        {"settle", Kind::count, false, "3", "good estimates in a row"},
        {"from", Kind::pose, false, "where it was last seen",
         "where the target should be now, to 5 cm and 3 degrees"}},
       read_track},
      {"approach",
       "closed loop, by the estimate alone, to a distance from the target",
       "10 min",
       {{"standoff", Kind::length, true, "", "from the sensor to the nearest surface"},
        {"speed", Kind::speed, true, "", "of the approach"},
        {"dock", Kind::boolean, false, "false",
         "the docking interface on the boresight, at the standoff"},
        guidance_key,
        target_motion_key},
       read_approach},
      {"hold",
       "stays where it is while tracking goes on",
       "its time and 30 s",
       {},
       nullptr,
       Kind::time,
       read_hold},
      {"station_keep",
       "closed loop: steers to keep the relative pose",
       "its time and 30 s",
       {{"for", Kind::time, true, "", "how long"}, guidance_key, target_motion_key},
       read_station_keep_map,
       Kind::time,
       read_station_keep},
      {"guided",
       "closed loop: the set-points of a GNC outside of Berth are flown",
       "its time and 30 s",
       {{"by", Kind::text, true, "", "the outside GNC's name, as its set-points say"},
        {"for", Kind::time, true, "", "at most"},
        {"speed", Kind::speed, true, "", "greatest of the chaser"},
        {"turn", Kind::angular_speed, false, "5 deg/s", "greatest of the chaser"},
        {"until", Kind::condition, false, "its time is over", "done when it is met"},
        target_motion_key},
       read_guided},
      {"wait", "lets time pass", "its time and 30 s", {}, nullptr, Kind::time, read_wait},
      {"wait_until",
       "until a condition is met",
       "60 s",
       {},
       nullptr,
       Kind::condition,
       read_wait_until},
      {"prompt",
       "asks the operator; with a text alone any answer will do",
       "10 min",
       {{"text", Kind::text, true, "", "the question"},
        {"choices", Kind::texts, false, "any text", "answers that are understood"},
        {"go_on", Kind::texts, false, "all", "answers with which the step has passed"},
        {"default", Kind::text, false, "none: TIMEOUT",
         "the answer when nobody gives one in time"}},
       read_prompt,
       Kind::text,
       read_prompt_text},
      {"annotate", "leaves a remark in the log", "10 s", {}, nullptr, Kind::text, read_annotate},
      {"record",
       "leaves the present value of a live quantity in the log",
       "10 s",
       {{"value", Kind::live, true, "", "the live quantity"},
        {"name", Kind::text, false, "the quantity's", "under which it is found"}},
       read_record,
       Kind::live,
       read_record_value},
      {"inject",
       "asks the simulated cell for a fault; an error on a real cell",
       "15 s",
       {{"device", Kind::text, true, "", "arm-replica, arm-sensor, lidar, plc or target"},
        {"fault", Kind::text, true, "", "of the device's list"},
        {"value", Kind::quantity, false, "0", "its size"},
        {"for", Kind::time, false, "until cleared", "after which it clears itself"},
        {"after", Kind::time, false, "at once", "in the midst of the steps that follow"}},
       read_inject},
      {"clear_injections",
       "ends injected faults, all of them when nothing stands behind it",
       "15 s",
       {{"device", Kind::text, true, "", "as injected"},
        {"fault", Kind::text, false, "all of the device", "as injected"}},
       read_clear_injections,
       std::nullopt,
       read_clear_all},
      {"stop_tracking",
       "the estimator asks for no more scans",
       "20 s",
       {},
       nullptr,
       std::nullopt,
       read_stop_tracking},
  };
}

}  // namespace

Lights read_lamps(Config& config, Lights lights) {
  read_lamp(config, "sun", lights.sun);
  read_lamp(config, "albedo", lights.albedo);
  config.optional("azimuth", Dimension::angle, lights.sun_azimuth);
  config.optional("elevation", Dimension::angle, lights.sun_elevation);
  return lights;
}

const std::vector<VerbInfo>& verbs() {
  static const std::vector<VerbInfo> all = make_verbs();
  return all;
}

const VerbInfo* verb_named(const std::string& name) {
  const auto& all = verbs();
  const auto found =
      std::find_if(all.begin(), all.end(), [&name](const VerbInfo& v) { return v.name == name; });
  return found == all.end() ? nullptr : &*found;
}

Read read_verb(const VerbInfo& verb, Config& step) {
  const bool is_map = step.raw(verb.name).IsMap();
  if (verb.from_map != nullptr && (is_map || verb.from_value == nullptr)) {
    Config map = step.section(verb.name);
    Read read = verb.from_map(map);
    finish_keys(map, verb.keys, verb.name);
    return read;
  }
  return verb.from_value(step);
}

void finish_keys(const Config& map, const std::vector<KeyInfo>& keys, const std::string& where) {
  map.finish();
  for (const std::string& key : map.asked()) {
    const auto same = [&key](const KeyInfo& info) { return info.key == key; };
    if (std::any_of(keys.begin(), keys.end(), same)) continue;
    throw std::logic_error("the table of '" + where + "' does not have its key '" + key + "'");
  }
}

}  // namespace berth::procedures
