// SPDX-License-Identifier: BSD-3-Clause
// Verbs that move the arms.
#include "procedures/language/step_options.h"
#include "procedures/language/verbs.h"

namespace berth::procedures {
namespace {

const KeyInfo guidance_key = {"guidance", Kind::text, false, "the testbed's own",
                              "profile of config/guidance, without its ending"};

const KeyInfo target_motion_key = {"target_motion", Kind::trajectory, false, "none",
                                   "the target's own motion meanwhile: a rule of trajectories, in "
                                   "the frame that the model has at the start"};

Read read_move(Config& config) {
  Move move;
  move.to = config.pose("to");
  move.speed = config.quantity("speed", Dimension::speed, above(0));
  move.angular_speed = radians(10);
  config.optional("turn", Dimension::angular_speed, move.angular_speed, above(0));
  if (config.has("frozen")) {
    move.frozen_arm = frozen_arm_of(config.choice("frozen", frozen_arms()));
  }
  return {move, 180};
}

Read read_retreat(Config& config) {
  Retreat retreat;
  if (config.has("speed")) retreat.speed = config.quantity("speed", Dimension::speed, above(0));
  return {retreat, 600};
}

Read read_trajectory_step(Config& step) {
  Trajectory trajectory = read_trajectory(step);
  const double timeout = trajectory.duration > 0 ? trajectory.duration + 120 : 600;
  return {std::move(trajectory), timeout};
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
  approach.standoff = config.quantity("standoff", Dimension::length, above(0));
  approach.speed = config.quantity("speed", Dimension::speed, above(0));
  if (config.has("dock")) {
    const std::string port = config.text("dock");
    if (port == "true") approach.port = "";
    if (port != "true" && port != "false") approach.port = port;
  }
  approach.loop = read_loop(config);
  return {approach, 600};
}

Read read_hold(Config& step) {
  const double duration = step.quantity("hold", Dimension::time, above(0));
  return {Hold{duration, false, {}}, duration + 30};
}

Read read_station_keep(Config& step) {
  const double duration = step.quantity("station_keep", Dimension::time, above(0));
  return {Hold{duration, true, {}}, duration + 30};
}

Read read_station_keep_map(Config& config) {
  const double duration = config.quantity("for", Dimension::time, above(0));
  return {Hold{duration, true, read_loop(config)}, duration + 30};
}

Read read_guided(Config& config) {
  Guided guided;
  guided.by = config.text("by");
  guided.duration = config.quantity("for", Dimension::time, above(0));
  guided.speed = config.quantity("speed", Dimension::speed, above(0));
  guided.angular_speed = radians(5);
  config.optional("turn", Dimension::angular_speed, guided.angular_speed, above(0));
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

}  // namespace

std::vector<VerbInfo> motion_verbs() {
  return {
      {"move",
       "straight to a relative pose, open loop",
       "3 min",
       {{"to", Kind::pose, true, "", "pose of the target in the sensor frame"},
        {"speed", Kind::speed, true, "", "greatest relative speed"},
        {"turn", Kind::angular_speed, false, "10 deg/s", "greatest relative turn rate"},
        {"frozen", Kind::words, false, "none", "the arm that stands still", frozen_arms()}},
       read_move},
      {"retreat",
       "back along the way that the arms came by the last motion, given up or not",
       "10 min",
       {{"speed", Kind::speed, false, "the testbed's own", "greatest relative speed"}},
       read_retreat},
      {"trajectory", "along a path made by one of these rules, open loop", "its end and 2 min",
       trajectory_keys(), nullptr, std::nullopt, read_trajectory_step},
      {"approach",
       "closed loop, by the estimate alone, to a distance from the target",
       "10 min",
       {{"standoff", Kind::length, true, "", "from the sensor to the nearest surface"},
        {"speed", Kind::speed, true, "", "of the approach"},
        {"dock", Kind::text, false, "false",
         "name of the docking port that comes to lie on the boresight, at the standoff; true: the "
         "target's first"},
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
       {{"by", Kind::text, true, "", "the outside GNC's name, the commander of its set-points"},
        {"for", Kind::time, true, "", "at most"},
        {"speed", Kind::speed, true, "", "greatest of the chaser"},
        {"turn", Kind::angular_speed, false, "5 deg/s", "greatest of the chaser"},
        {"until", Kind::condition, false, "its time is over", "done when it is met"},
        target_motion_key},
       read_guided},
  };
}

}  // namespace berth::procedures
