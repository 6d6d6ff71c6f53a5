// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/procedure_text.h"

#include "common/core/text.h"

namespace berth {
namespace {

std::string listed(const Pose& pose) {
  std::string text;
  for (const double value : xyzwpr_from_pose(pose)) {
    text += (text.empty() ? "[" : ", ") + fixed(value, 3);
  }
  return text + "]";
}

const char* word(testbed::FrozenArm arm) {
  constexpr const char* words[] = {"none", "replica", "sensor"};
  return words[static_cast<int>(arm)];
}

std::string rates(double speed, double turn) {
  return "speed: " + fixed(1e3 * speed, 0) + " mm/s, turn: " + fixed(degrees(turn), 1) + " deg/s";
}

std::string move(const Pose& to, double speed, double turn, testbed::FrozenArm frozen) {
  return "move: {to: " + listed(to) + ", " + rates(speed, turn) + ", frozen: " + word(frozen) + "}";
}

}  // namespace

std::string calibration_procedure(const RunSetup& setup, const testbed::PoseSelection& selection,
                                  const Pose& home, const testbed::CalibrationView& view,
                                  const CalibrationPace& pace) {
  using testbed::FrozenArm;
  std::string text = "# SPDX-License-Identifier: BSD-3-Clause\nname: calibration\n";
  text +=
      "description: >\n  Made by berth calibrate: the target is measured at rest in " +
      std::to_string(selection.poses.size()) +
      " poses chosen for their information on the cell, then with each arm in fast motion for the "
      "clocks.\n";
  text += "layout: " + setup.layout + "\n";
  if (!setup.target.empty()) text += "target: " + setup.target + "\n";
  if (setup.target_length > 0) {
    text += "target_length: " + std::to_string(setup.target_length) + " m\n";
  }
  text += "\nsteps:\n  - " + move(home, pace.speed, pace.turn, FrozenArm::none) +
          "\n  - acquire: {gate: [" + fixed(0.6 * view.nearest, 1) + " m, " +
          fixed(1.2 * view.farthest, 1) +
          " m]}\n    timeout: 2 min\n  - track: {returns: " + std::to_string(pace.returns) +
          ", settle: 5}\n  - calibrate:\n      speed: " + fixed(1e3 * pace.speed, 0) +
          " mm/s\n      turn: " + fixed(degrees(pace.turn), 1) +
          " deg/s\n      estimates: " + std::to_string(pace.estimates) +
          "\n      returns: " + std::to_string(pace.returns) +
          "\n      settle: 2 s\n      frozen: [";
  for (std::size_t i = 0; i < selection.poses.size(); ++i) {
    text += (i == 0 ? "" : ", ") + std::string(word(selection.poses[i].frozen));
  }
  text += "]\n      poses:\n";
  for (const auto& pose : selection.poses) text += "        - " + listed(pose.relative) + "\n";
  for (const testbed::FastStroke& stroke : selection.strokes) {
    text += "  - " + move(stroke.from, pace.speed, pace.turn, stroke.frozen) +
            "\n    name: to the stroke\n    when_lost: ignore\n"
            "  - track: {from: " +
            listed(stroke.from) + ", returns: " + std::to_string(pace.returns) +
            ", settle: 2}\n    on_failure: continue\n  - repeat:\n      times: " +
            std::to_string((pace.strokes + 1) / 2) + "\n      steps:\n";
    for (const Pose& to : {stroke.to, stroke.from}) {
      text += "        - " + move(to, stroke.speed, pace.turn, stroke.frozen) +
              "\n          name: stroke\n          phase: stroke\n          when_lost: ignore\n";
    }
  }
  text +=
      "\ncriteria:\n  - name: the target is seen at the poses\n    measurement: tracking_share\n   "
      " "
      "phase: calibrate\n    min: 50 %\n";
  return text;
}

}  // namespace berth
