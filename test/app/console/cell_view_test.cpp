// SPDX-License-Identifier: BSD-3-Clause
// What the console shows of made-up messages, without a bus, a server or a clock.
#include "app/console/view/cell_view.h"

#include <Eigen/Eigenvalues>
#include <berth/estimator_diagnostics_t.hpp>
#include <berth/heartbeat_t.hpp>
#include <berth/run_info_t.hpp>
#include <berth/scan_request_t.hpp>

#include "app/console/view/cell_status.h"
#include "app/console/view/estimate_sections.h"
#include "common/core/beam_model.h"
#include "lcmtypes/scan_packet.h"
#include "test/app/console/written_board.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::console;

namespace {

const Cell& cell() {
  static const Cell loaded = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  return loaded;
}

struct Shown {
  WrittenBoard board;
  CellView view{cell(), load_lidar_profile("config/lidars/ilris_3d.yaml"), own_types(), board};

  template <class Message>
  void receive(const char* channel, const Message& message, Utime received) {
    view.take(Event(channel, message, received).event);
  }
  void truth_until(Utime end) {
    for (Utime t = made::start; t <= end; t += 8 * millisecond) {
      receive(channels::ground_truth, made::truth(t, made::flight(seconds(t - made::start))),
              t + 20 * millisecond);
    }
  }
};

Pose pose_in(const nlohmann::ordered_json& json) {
  const auto v = json.get<std::vector<double>>();
  return {Vector3d(v[0], v[1], v[2]), Quaterniond(v[3], v[4], v[5], v[6])};
}

arm_state_t arm_at(const Joints& joints, Utime utime) {
  arm_state_t state{};
  state.utime = utime;
  state.valid = true;
  state.state = arm_state_t::IDLE;
  std::copy(joints.begin(), joints.end(), state.reported_joint);
  return state;
}

ScanPacket packet_of(std::int64_t scan_id, const std::vector<float>& ranges) {
  ScanPacket packet{};
  packet.scan_id = scan_id;
  packet.scan_status = ScanPacket::RUNNING;
  packet.resize(ranges.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    packet.range_m[i] = ranges[i];
    packet.azimuth_rad[i] = 0.1F;
    packet.elevation_rad[i] = -0.05F;
    packet.status[i] = ranges[i] > 0 ? ScanPacket::HIT : ScanPacket::MISS;
  }
  return packet;
}

}  // namespace

TEST_CASE("every body has a mesh, and a frame whose pose is published") {
  Shown shown;
  shown.view.flush(made::start);
  const auto meshes = mesh_texts(drawn_bodies(cell()));
  std::size_t triangles = 0;
  for (const auto& body : shown.board.sections.at("scene").at("bodies")) {
    const auto mesh = nlohmann::json::parse(meshes.at(body.at("mesh")));
    const std::size_t vertices = mesh.at("positions").size() / 3;
    for (const std::size_t index : mesh.at("indices")) REQUIRE(index < vertices);
    triangles += mesh.at("indices").size() / 3;
    const std::string frame = body.at("frame");
    INFO(frame);
    CHECK((frame == "cell" || shown.board.sections.at("frames").contains(frame)));
  }
  CHECK(triangles > 500);
}

TEST_CASE(
    "frames follow the joints; the replica is where truth has it, the ghost where the estimate") {
  Shown shown;
  Joints sensor = cell().sensor.home;
  sensor[0] += 0.1;
  const Utime now = made::start + 2 * second;
  shown.receive(channels::arm_state_sensor, arm_at(sensor, now), now);
  shown.receive(channels::arm_state_replica, arm_at(cell().replica.home, now), now);
  shown.view.flush(now);
  const auto& frames = shown.board.sections["frames"];
  const Pose at_sensor = cell().sensor.tool_pose(sensor);
  CHECK(distance(pose_in(frames.at("sensor")), at_sensor) < 1e-4);
  CHECK(distance(pose_in(frames.at("replica")), cell().replica.tool_pose(cell().replica.home)) <
        1e-4);
  CHECK_FALSE(frames.contains("ghost"));

  shown.truth_until(now);
  pose_estimate_t estimate = made::estimate(now - second / 2, made::flight(1.5));
  estimate.linear_velocity_m_s[0] = 0.1;
  shown.receive(channels::pose_estimate, estimate, now);
  shown.view.flush(now);
  CHECK(distance(pose_in(frames.at("replica")), at_sensor * made::flight(2)) < 1e-4);
  Pose moved_on = made::flight(1.5);
  moved_on.position.x() += 0.05;
  CHECK(distance(pose_in(frames.at("ghost")), at_sensor * moved_on) < 1e-4);

  shown.view.flush(now + 3 * second);
  CHECK_FALSE(frames.contains("ghost"));  // an old estimate is none
}

TEST_CASE("an estimate is compared with the truth of its own time, with its latency") {
  Shown shown;
  const Utime at = made::start + second + 3 * millisecond;
  Pose pose = made::flight(seconds(at - made::start));
  pose.position.x() += 0.004;
  pose.rotation = rotation_from_vector({0, radians(0.5), 0}) * pose.rotation;
  shown.receive(channels::pose_estimate, made::estimate(at, pose), at + 40 * millisecond);
  estimator_diagnostics_t diagnostics{};
  diagnostics.seq = at;
  diagnostics.names = {"latency_us"};
  diagnostics.values = {31000};
  diagnostics.value_count = 1;
  shown.receive(channels::estimator_diagnostics, diagnostics, at + 41 * millisecond);
  shown.view.advance(at + 50 * millisecond);
  CHECK(shown.board.lists["samples"].empty());  // truth of that time has not come yet

  shown.truth_until(at + 200 * millisecond);
  shown.view.advance(at + 220 * millisecond);
  REQUIRE(shown.board.lists["samples"].size() == 1);
  const auto& sample = shown.board.lists["samples"][0];
  CHECK(sample.at("position_mm").get<double>() == Approx(4).epsilon(0.01));
  CHECK(sample.at("error")[0].get<double>() == Approx(4).epsilon(0.01));
  CHECK(sample.at("attitude_deg").get<double>() == Approx(0.5).epsilon(0.01));
  CHECK(sample.at("error")[4].get<double>() == Approx(0.5).epsilon(0.01));
  CHECK(sample.at("sigma3")[0].get<double>() == Approx(9));
  CHECK(sample.at("truth_sigma3")[0].get<double>() == Approx(3));
  CHECK(sample.at("latency_s").get<double>() == Approx(0.031));
  CHECK(shown.board.sections["estimate"].at("error").at("position_m").get<double>() ==
        Approx(0.004).epsilon(0.01));
}

TEST_CASE("an estimate for which no truth comes is shown without error") {
  Shown shown;
  const Utime at = made::start;
  shown.receive(channels::pose_estimate, made::estimate(at, made::flight(0)), at);
  shown.receive(channels::pose_estimate, made::estimate(at + 1, {}, pose_estimate_t::LOST), at);
  shown.view.advance(at + 2 * second);
  REQUIRE(shown.board.lists["samples"].size() == 2);
  CHECK(shown.board.lists["samples"][0].at("truth").is_null());
  CHECK_FALSE(shown.board.lists["samples"][1].contains("estimate"));
}

TEST_CASE("returns come as they are scanned, and a new scan begins anew") {
  Shown shown;
  scan_request_t request{};
  request.scan_id = 5;
  request.windows.resize(2);
  request.window_count = 2;
  shown.receive(channels::scan_request, request, made::start);
  shown.receive(channels::scan_data, packet_of(5, {5.0F, 0.0F, 6.0F}), made::start);
  shown.view.flush(made::start);
  const Vector3d first = 5e3 * beam_direction(0.1, -0.05);
  REQUIRE(shown.board.lists["returns"].size() == 6);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(std::abs(shown.board.lists["returns"][i].get<double>() -
                   first[static_cast<Eigen::Index>(i)]) <= 0.51);
  }
  CHECK(shown.board.sections["scan"].at("windows").size() == 2);
  CHECK(shown.board.sections["scan"].at("beams") == 3);
  shown.receive(channels::scan_data, packet_of(5, {4.0F}), made::start);
  shown.view.flush(made::start);
  CHECK(shown.board.lists["returns"].size() == 9);
  shown.receive(channels::scan_data, packet_of(6, {4.0F}), made::start);
  shown.view.flush(made::start);
  CHECK(shown.board.lists["returns"].size() == 3);
  CHECK(shown.board.sections["scan"].at("windows").empty());  // its request was not received
}

TEST_CASE("both returns of a beam are shown, from where the beam left") {
  Shown shown;
  ScanPacket packet = packet_of(5, {5.0F});
  packet.azimuth_rad[0] = packet.elevation_rad[0] = 0;
  packet.range2_m[0] = 7;
  packet.origin_x_m[0] = 0.25F;
  shown.receive(channels::scan_data, packet, made::start);
  shown.view.flush(made::start);
  CHECK(shown.board.lists["returns"] == nlohmann::json::array({250, 0, 5000, 250, 0, 7000}));
  CHECK(shown.board.sections["scan"].at("hits") == 1);
}

TEST_CASE("messages of unknown types are counted and otherwise ignored") {
  Shown shown;
  shown.receive(channels::ground_truth, made::truth(made::start, made::flight(0)), made::start);
  std::vector<std::uint8_t> noise;
  for (int length = 0; length < 200; ++length) {
    for (const char* channel :
         {channels::pose_estimate, channels::ground_truth, channels::scan_data, channels::run_info,
          channels::node_status, channels::procedure_state, channels::event, "FOREIGN"}) {
      logs::LogEvent event;
      event.utime = made::start;
      event.channel = channel;
      event.data = noise;
      shown.view.take(event);
    }
    noise.push_back(static_cast<std::uint8_t>(31 * length + 7));
  }
  // A message of ours, with the lengths in it damaged.
  Event packet(channels::scan_data, packet_of(3, {5.0F, 6.0F}), made::start);
  for (std::size_t i = 8; i < packet.bytes.size(); ++i) {
    const std::uint8_t was = std::exchange(packet.bytes[i], std::uint8_t{0xff});
    shown.view.take(packet.event);
    packet.bytes[i] = was;
  }
  shown.view.flush(made::start + second);
  CHECK(pose_in(shown.board.sections.at("truth").at("pose")).position.z() == Approx(5));
  std::int64_t undecodable = 0;
  for (const auto& channel : shown.board.sections.at("channels")) {
    undecodable += channel.at("undecodable").get<std::int64_t>();
  }
  CHECK(undecodable >= 200);
}

TEST_CASE("sections are written no more often than they should be") {
  Shown shown;
  for (Utime t = made::start; t < made::start + 10 * second; t += 2 * millisecond) {
    shown.receive(channels::ground_truth, made::truth(t, made::flight(0)), t);
    shown.view.advance(t);
  }
  CHECK(shown.board.writes["truth"] <= 201);
  CHECK(shown.board.writes["truth"] >= 150);
  CHECK(shown.board.writes["channels"] <= 11);
}

TEST_CASE("a node's health: age of its heartbeat, gaps in its messages") {
  Shown shown;
  heartbeat_t beat{};
  beat.node = "testbed";
  for (const std::int64_t seq : {1, 2, 3, 6}) {
    beat.seq = seq;
    beat.utime = made::start + seq * 50 * millisecond;
    shown.receive(channels::heartbeat, beat, beat.utime);
  }
  shown.view.flush(made::start + second);
  const auto& node = shown.board.sections["nodes"].at(0);
  CHECK(node.at("node") == "testbed");
  CHECK(node.at("gaps") == 2);
  CHECK(node.at("age_s").get<double>() == Approx(0.7));
}

TEST_CASE("the ellipsoid's axes are those of the covariance") {
  const Quaterniond turn = rotation_from_vector({0.3, -0.5, 1.1});
  const Matrix3d axes = turn.toRotationMatrix();
  const Vector3d variances(4e-6, 1e-6, 9e-6);
  const Matrix3d covariance = axes * variances.asDiagonal() * axes.transpose();
  const Ellipsoid ellipsoid = ellipsoid_of(covariance);
  CHECK(ellipsoid.radii.isApprox(Vector3d(1e-3, 2e-3, 3e-3), 1e-6));
  const Matrix3d found = ellipsoid.rotation.toRotationMatrix();
  CHECK(covariance.isApprox(found * ellipsoid.radii.cwiseAbs2().asDiagonal() * found.transpose(),
                            1e-9));
}

TEST_CASE("the status of the whole cell is the worst of its conditions") {
  const Utime now = made::start;
  CellMessages latest;
  CHECK(cell_status(latest, now).word == "attention");  // no messages
  latest.beats["testbed"] = now;
  CHECK(cell_status(latest, now).word == "safe");
  latest.replica_arm = arm_at({}, now);
  latest.replica_arm->tcp_speed_m_s = 0.2;
  CHECK(cell_status(latest, now).word == "moving");
  latest.procedure.emplace();
  latest.procedure->state = procedure_state_t::HELD;
  CHECK(cell_status(latest, now).word == "held");
  // a testbed that was commanded to hold is degraded, and rightly
  latest.testbed.emplace();
  latest.testbed->state = testbed_state_t::HELD;
  latest.nodes["testbed"].state = node_status_t::DEGRADED;
  CHECK(cell_status(latest, now).word == "held");
  latest.testbed->state = testbed_state_t::HOLDING;
  CHECK(cell_status(latest, now).word == "attention");
  latest.nodes.erase("testbed");
  latest.nodes["lidar-driver"].state = node_status_t::DEGRADED;
  latest.nodes["lidar-driver"].reason = "no answer";
  const CellStatus degraded = cell_status(latest, now);
  CHECK(degraded.word == "attention");
  CHECK(degraded.why.find("no answer") != std::string::npos);
  CHECK(degraded.why.find("200 mm/s") != std::string::npos);  // the motion is reported still
  latest.facility.emplace();
  latest.facility->valid = true;
  latest.facility->fence_closed = true;
  CHECK(cell_status(latest, now).word == "stop");
  latest.facility->estop_chain_closed = true;
  CHECK(cell_status(latest, now).word == "attention");
  latest.nodes.clear();
  CHECK(cell_status(latest, now + second).word == "attention");  // testbed is silent
}

TEST_CASE("criteria are pending until their phase is over") {
  procedure_state_t state = made::state({{"acquire", 0, 2}, {"track", 2, 4}});
  state.state = procedure_state_t::RUNNING;
  state.steps[1].state = procedure_step_t::RUNNING;
  CHECK(is_over("acquire", state));
  CHECK_FALSE(is_over("track", state));
  CHECK_FALSE(is_over(evaluation::whole_run, state));
  criterion_result_t decided{};
  decided.value = 3;
  decided.result = criterion_result_t::PASSED;
  decided.phase = "acquire";
  criterion_result_t later = decided;
  later.phase = "track";
  const auto results = as_of({decided, later}, state);
  CHECK(results[0].value == 3);
  CHECK(results[1].result == criterion_result_t::PENDING);
  CHECK(std::isnan(results[1].value));
}

TEST_CASE("criteria of the procedure that runs are measured as it goes") {
  Shown shown;
  run_info_t info{};
  info.session = made::session;
  info.run = "made";
  info.target = "radarsat2";
  attachment_t attachment{};
  attachment.name = "procedure.yaml";
  attachment.content = R"(name: made
description: made
steps:
  - acquire: {gate: [3 m, 8 m]}
  - track: {settle: 1}
criteria:
  - {name: near enough, measurement: position_error, statistic: rms, phase: track, max: 10 mm}
)";
  info.attachments = {attachment};
  info.attachment_count = 1;
  shown.receive(channels::run_info, info, made::start);
  shown.truth_until(made::start + 4 * second);
  Pose pose = made::flight(2);
  pose.position.x() += 0.004;
  shown.receive(channels::pose_estimate, made::estimate(made::start + 2 * second, pose),
                made::start + 2 * second);
  procedure_state_t state = made::state({{"track", 0, 0}});
  state.state = procedure_state_t::RUNNING;
  state.outcome = procedure_state_t::NONE;
  state.utime = made::start + 4 * second;
  state.steps[0].state = procedure_step_t::RUNNING;
  state.steps[0].utime_end = 0;
  shown.receive(channels::procedure_state, state, state.utime);
  shown.view.flush(state.utime);
  const auto& criterion = shown.board.sections["procedure"].at("criteria").at(0);
  CHECK(criterion.at("result") == criterion_result_t::PENDING);
  CHECK(criterion.at("value").get<double>() == Approx(4).epsilon(0.01));
  CHECK(criterion.at("upper_limit").get<double>() == Approx(10));
}
