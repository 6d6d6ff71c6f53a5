// SPDX-License-Identifier: BSD-3-Clause
// Ground truth where the controllers report commanded positions.
#include <berth/ground_truth_t.hpp>
#include <fstream>
#include <regex>

#include "common/core/error.h"
#include "common/core/file.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/testbed/safety/world.h"
#include "testbed/truth/truth_covariance.h"

namespace berth::drills {
namespace {

using Catch::Matchers::Contains;

constexpr double lag = 0.02;  // s

/// A configuration whose controllers report so.
std::filesystem::path configuration(const TemporaryDirectory& directory, const std::string& how) {
  const auto config = directory.path() / "config";
  std::filesystem::copy(
      "config", config,
      std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
  std::ofstream(config / "devices.yaml") << std::regex_replace(
      read_file("config/devices.yaml"), std::regex("positions: measured[^\n]*"), how);
  return config;
}

struct Truths {
  ground_truth_t moving{};
  ground_truth_t stationary{};
  std::map<ArmRole, arm_state_t> arms;  // while moving
  std::map<ArmRole, Joints> rates;
};

Truths fly(const std::filesystem::path& config) {
  World::Options options;
  options.config = config;
  World world(options);
  ground_truth_t truth{};
  world.simulation.make_bus().subscribe<ground_truth_t>(
      channels::ground_truth, Queue::fifo(), [&](const ground_truth_t& m) { truth = m; });
  Truths truths;
  world.begin_move(0.1);
  const auto before = world.arms;
  world.run_for(0.1);
  truths.moving = truth;
  truths.arms = world.arms;
  for (const auto& [role, now] : world.arms) {
    const arm_state_t& then = before.at(role);
    for (std::size_t i = 0; i < 6; ++i) {
      truths.rates[role][i] =
          (now.reported_joint[i] - then.reported_joint[i]) / seconds(now.utime - then.utime);
    }
  }
  world.send(testbed_command2_t::HOLD);
  world.run_for(3);
  truths.stationary = truth;
  return truths;
}

Matrix6d covariance_of(const ground_truth_t& truth) { return Matrix6d::Map(truth.covariance); }

TEST_CASE("commanded positions widen truth by the servos' following error, in motion alone") {
  const TemporaryDirectory directory;
  const Truths measured = fly("config");
  const Truths commanded =
      fly(configuration(directory, "positions: commanded\n  following_lag: 20 ms"));
  REQUIRE(measured.moving.utime == commanded.moving.utime);
  for (int i = 0; i < 3; ++i) {
    CHECK(measured.moving.position_m[i] == commanded.moving.position_m[i]);
  }

  // Joints that are off by their speed times the lag, each by itself.
  testbed::ArmPair joints;
  std::copy_n(measured.arms.at(ArmRole::replica).reported_joint, 6, joints.replica.begin());
  std::copy_n(measured.arms.at(ArmRole::sensor).reported_joint, 6, joints.sensor.begin());
  const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  const auto jacobian = testbed::relative_jacobian(cell, joints);
  Matrix6d expected = Matrix6d::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const Vector6d replica = lag * measured.rates.at(ArmRole::replica)[i] * jacobian.col(column);
    const Vector6d sensor = lag * measured.rates.at(ArmRole::sensor)[i] * jacobian.col(column + 6);
    expected += replica * replica.transpose() + sensor * sensor.transpose();
  }
  const Matrix6d added = covariance_of(commanded.moving) - covariance_of(measured.moving);
  CHECK(std::sqrt(expected.topLeftCorner<3, 3>().trace()) > 5e-4);  // m: worth telling
  CHECK((added - expected).norm() < 0.1 * expected.norm());

  const Matrix6d at_rest = covariance_of(commanded.stationary) - covariance_of(measured.stationary);
  CHECK(at_rest.norm() < 1e-4 * covariance_of(measured.stationary).norm());
}

TEST_CASE("a site that reports commanded positions states the servos' following error") {
  const TemporaryDirectory directory;
  const auto wrong = [&](const std::string& how) {
    try {
      load_devices(configuration(directory, how));
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK_THAT(wrong("positions: commanded"), Contains("devices.yaml") && Contains("following_lag"));
  CHECK_THAT(wrong("positions: guessed"), Contains("positions") && Contains("guessed"));
  CHECK_THAT(wrong("positions: measured\n  following_lag: 20 ms"),
             Contains("is of 'positions: commanded' alone"));
  CHECK_THAT(wrong("positions: commanded\n  following_lag: 0 ms"),
             Contains("expected a time above 0"));
}

}  // namespace
}  // namespace berth::drills
