// SPDX-License-Identifier: BSD-3-Clause
// The messages of an estimator of one's own, with the simulated clock; its method does as it is
// told.
#include "estimator/node/scan_estimator.h"

#include "common/bus/simulation.h"
#include "test/catch.h"
#include "test/estimator/node/fold_fixture.h"

using namespace berth;
using namespace berth::estimator;

namespace {

class Obedient final : public ScanEstimator {
 public:
  using ScanEstimator::ScanEstimator;
  std::optional<ScanPose> answer = ScanPose{start_pose, 1e-4 * Matrix6d::Identity(), 321};
  std::vector<bool> had_last;
  std::vector<std::size_t> points;

 private:
  std::string method() const override { return "obedient"; }
  std::optional<ScanPose> estimate(const PreprocessedScan& scan,
                                   const std::optional<Pose>& last) override {
    had_last.push_back(last.has_value());
    points.push_back(scan.points.size());
    return answer;
  }
};

/// One on a bus of session 7, and a commander whose LIDAR answers while it is on.
struct OwnEstimatorRig {
  Simulation simulation;
  SimulatedLoop& loop = simulation.make_loop();
  SimulatedBus& bus = simulation.make_bus();
  SimulatedLoop& other_loop = simulation.make_loop();
  SimulatedBus& other = simulation.make_bus();
  ScanMaker lidar{replica().mesh};
  bool lidar_on = true;
  std::vector<scan_request_t> requests;
  std::vector<pose_estimate_t> estimates;
  std::vector<estimator_state_t> states;
  std::unique_ptr<Obedient> estimator;

  OwnEstimatorRig() {
    lidar.pose = start_pose;
    RunSetup run;
    run.config = "config";
    run.target = "radarsat2";
    estimator = std::make_unique<Obedient>(NodeSetup{"estimator", 7, "hash"}, run, bus, loop);
    other.subscribe<scan_request_t>(channels::scan_request, Queue::fifo(),
                                    [this](const scan_request_t& r) { take(r); });
    other.subscribe<pose_estimate_t>(channels::pose_estimate, Queue::fifo(),
                                     [this](const auto& e) { estimates.push_back(e); });
    other.subscribe<estimator_state_t>(channels::estimator_state, Queue::fifo(),
                                       [this](const auto& s) { states.push_back(s); });
  }
  void take(const scan_request_t& request) {
    const bool again = !requests.empty() && requests.back().scan_id == request.scan_id;
    requests.push_back(request);
    if (!lidar_on || again) return;
    lidar.utime = other_loop.now();
    for (const ScanPacket& p : berth::estimator::answer(lidar, request)) {
      other_loop.at(p.utime + p.time_us.back(),
                    [this, p] { other.publish(channels::scan_data, p); });
    }
  }
  void send(std::int8_t what, std::int64_t seq, std::int64_t session = 7) {
    estimator_command_t c = command(what, seq, 0);
    c.session = session;
    other.publish(channels::estimator_command, c);
    simulation.run_for(second / 100);
  }
};

}  // namespace

TEST_CASE(
    "An estimator of one's own acquires with the field of view, then tracks around the pose") {
  OwnEstimatorRig rig;
  rig.send(estimator_command_t::ACQUIRE, 1);
  CHECK(rig.states.back().mode == estimator_state_t::ACQUIRING);
  CHECK(rig.states.back().command_seq == 1);
  rig.simulation.run_for(10 * second);
  REQUIRE(rig.estimates.size() > 2);
  CHECK(rig.states.back().mode == estimator_state_t::TRACKING);
  CHECK_FALSE(rig.estimator->had_last.front());
  CHECK(rig.estimator->had_last.back());
  CHECK(rig.estimator->points.back() > 100);
  CHECK(rig.requests.back().windows[0].width_rad < rig.requests.front().windows[0].width_rad);

  const pose_estimate_t& estimate = rig.estimates.back();
  CHECK(estimate.status == pose_estimate_t::OK);
  CHECK(estimate.session == 7);
  CHECK(estimate.command_seq == 1);
  CHECK(estimate.scan_id == static_cast<std::int64_t>(rig.estimates.size()));
  CHECK(estimate.seq == estimate.scan_id);
  CHECK(estimate.method == "obedient");
  CHECK(estimate.returns_used == 321);
  CHECK(pose_of(estimate).position == start_pose.position);
  CHECK(estimate.covariance[0] == 1e-4);

  rig.send(estimator_command_t::STOP, 2);
  rig.simulation.run_for(2 * second);
  CHECK(rig.states.back().mode == estimator_state_t::IDLE);
  const std::size_t before = rig.requests.size();
  rig.simulation.run_for(3 * second);
  CHECK(rig.requests.size() == before);
}

TEST_CASE("An estimator of one's own answers a repeated command, and obeys it once") {
  OwnEstimatorRig rig;
  rig.send(estimator_command_t::TRACK, 1);
  CHECK(rig.states.back().refused_seq == 1);
  CHECK(rig.states.back().reason == "acquire first");
  CHECK(rig.states.back().mode == estimator_state_t::IDLE);
  rig.send(estimator_command_t::CHOOSE_MODEL, 2);
  CHECK(rig.states.back().refused_seq == 2);
  CHECK(rig.states.back().reason == "expected STOP, ACQUIRE or TRACK");
  rig.send(estimator_command_t::ACQUIRE, 3, 8);  // of another session
  CHECK(rig.requests.empty());

  rig.send(estimator_command_t::ACQUIRE, 3);
  rig.simulation.run_for(5 * second);
  REQUIRE(rig.states.back().mode == estimator_state_t::TRACKING);
  const std::size_t answers = rig.states.size();
  rig.send(estimator_command_t::ACQUIRE, 3);
  CHECK(rig.states.size() > answers);
  CHECK(rig.states.back().mode == estimator_state_t::TRACKING);
}

TEST_CASE("An estimator of one's own repeats a request that was lost, and acquires what was lost") {
  OwnEstimatorRig rig;
  rig.lidar_on = false;
  rig.send(estimator_command_t::ACQUIRE, 1);
  REQUIRE(rig.requests.size() == 1);
  rig.simulation.run_for(3 * second);
  CHECK(rig.requests.size() >= 3);
  CHECK(rig.requests.back().scan_id == rig.requests.front().scan_id);
  CHECK(rig.requests.back().seq > rig.requests.front().seq);

  rig.lidar_on = true;
  rig.requests.clear();
  rig.estimator->answer.reset();
  rig.simulation.run_for(10 * second);
  REQUIRE_FALSE(rig.estimates.empty());
  CHECK(rig.estimates.back().status == pose_estimate_t::LOST);
  CHECK(rig.estimates.back().reason == "the target was not found in the scan");
  CHECK(rig.states.back().mode == estimator_state_t::ACQUIRING);
  CHECK_FALSE(rig.estimator->had_last.back());
}
