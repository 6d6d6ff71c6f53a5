// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "test/testbed/safety/world.h"

namespace berth::drills {

/// One thing that goes wrong while both arms move.
struct Drill {
  std::string name;
  bool closed_loop = false;
  std::function<void(World&)> begin;
  /// Puts right what can be put right without a new run; empty: nothing can.
  std::function<void(World&)> mend;
  /// The operator's command then; RESUME follows a RESET.
  std::optional<std::int8_t> command;
  /// Whether what is out now contradicts what is so; empty: the fault itself is the first sign.
  std::function<bool(World&)> contradicts;
  /// What the operator may read first of what stops the arms, and what the testbed then does.
  std::vector<std::string> codes;
  std::int8_t state = testbed_state_t::HELD;
  /// How it resumes, in words.
  std::string resumes;
};

/// Times in s from the first sign; negative: it did not happen.
struct Outcome {
  double first_sign = -1;    ///< after the fault
  double seen = -1;          ///< the event's
  double held = -1;          ///< no controller follows set-points any more
  double braking = -1;       ///< the later of both arms goes slower, in the simulated world
  double at_rest = -1;       ///< both arms stand, in the simulated world
  double min_clearance = 0;  ///< m, from the fault to the end
  std::string code;          ///< of the testbed's first warning or error; without one, of any node
  std::string text;
  std::int8_t state = -1;  ///< of the testbed, before anything was mended
  bool resumed = false;    ///< it went on as it should
  std::string failure;     ///< why not; empty
};

const std::vector<Drill>& drills();

/// @param instant s into the steady motion at which it goes wrong.
Outcome run(const Drill& drill, std::uint64_t seed, double instant);

/// Empty, or which promise is broken.
std::string verdict(const Drill& drill, const Outcome& outcome);

}  // namespace berth::drills
