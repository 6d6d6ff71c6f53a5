// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/arm_state_t.hpp>
#include <berth/facility_state_t.hpp>
#include <berth/lidar_state_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <optional>

namespace berth {

/// The latest state that each part of a cell has published; empty: none yet.
struct LatestMessages {
  std::optional<arm_state_t> replica_arm;
  std::optional<arm_state_t> sensor_arm;
  std::optional<facility_state_t> facility;
  std::optional<lidar_state_t> lidar;
  std::optional<pose_estimate_t> estimate;
  std::optional<procedure_state_t> procedure;
  std::optional<testbed_state_t> testbed;

  void on(const facility_state_t& message) { facility = message; }
  void on(const lidar_state_t& message) { lidar = message; }
  void on(const pose_estimate_t& message) { estimate = message; }
  void on(const procedure_state_t& message) { procedure = message; }
  void on(const testbed_state_t& message) { testbed = message; }
};

}  // namespace berth
