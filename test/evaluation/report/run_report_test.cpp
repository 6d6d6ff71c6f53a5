// SPDX-License-Identifier: BSD-3-Clause
#include <berth/node_status_t.hpp>
#include <cmath>

#include "common/core/beam_model.h"
#include "common/core/file.h"
#include "common/targets/target.h"
#include "evaluation/report/report.h"
#include "evaluation/report/scan_picture.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "logs/file/log_writer.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::report;
namespace fs = std::filesystem;

namespace {

template <class Message>
void record(logs::LogWriter& log, const char* channel, const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  log.write(message.utime, channel, bytes);
}

ScanPacket packet_of(std::int64_t scan, Utime utime, const RayCaster& target, const Pose& pose) {
  ScanPacket packet{};
  packet.utime = utime;
  packet.session = made::session;
  packet.scan_id = scan;
  const Pose inverse = pose.inverse();
  packet.resize(21);
  for (std::size_t i = 0; i < 21; ++i) {
    const double azimuth = 0.02 * (static_cast<double>(i) - 10);
    RayHit hit;
    const bool met =
        target.cast({inverse.position, inverse.rotation * beam_direction(azimuth, 0)}, 100, hit);
    packet.time_us[i] = static_cast<std::int32_t>(i);
    packet.range_m[i] = met ? static_cast<float>(hit.range) : 0;
    packet.azimuth_rad[i] = static_cast<float>(azimuth);
    packet.status[i] = met ? ScanPacket::HIT : ScanPacket::MISS;
  }
  return packet;
}

/// Two phases; in the second the target is lost for a while. Its texts try to become markup.
void make_run(const fs::path& directory) {
  const Target target = load_target("radarsat2", 0);
  const RayCaster caster(target.mesh);
  logs::LogWriter log(directory / "run.lcm");
  run_info_t info{};
  info.utime = made::start;
  info.session = made::session;
  info.run = "made & <b>run</b>";
  info.target = "radarsat2";
  info.target_hash = target.hash;
  attachment_t procedure{};
  procedure.name = "procedure.yaml";
  procedure.content =
      "name: made\ncriteria:\n"
      "  - {name: <i>z</i>, measurement: z_error, statistic: rms, phase: go, max: 2 mm, claim: "
      "'<b>below</b> 2 mm'}\n"
      "  - {name: x, measurement: x_error, statistic: rms, phase: go, max: 9 mm, claim: small}\n"
      "  - {name: y, measurement: y_error, statistic: rms, phase: go, max: 2 mm}\n"
      "source: A & B\n"
      "figures:\n"
      "  - name: Figure <3>\n"
      "    charts:\n"
      "      - {draw: [z_error], phase: go, over: sample, criteria: [<i>z</i>]}\n"
      "      - {draw: [position_error], statistic: peak, phases: [go, hold]}\n"
      "      - {draw: [x, y, z], phase: go}\n";
  info.attachments = {procedure};
  info.attachment_count = 1;
  record(log, channels::run_info, info);
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.1 * i;
    const Utime utime = made::start + i * 100 * millisecond;
    record(log, channels::ground_truth, made::truth(utime, made::flight(t)));
    if (i % 5 != 0) continue;
    const bool lost = i > 140 && i < 160;
    Pose pose = made::flight(t);
    pose.position.z() += 5e-3;
    auto estimate = made::estimate(utime, pose, lost ? pose_estimate_t::LOST : pose_estimate_t::OK);
    estimate.scan_id = i;
    estimate.reason = lost ? "<script>alert(1)</script>" : "";
    record(log, channels::scan_data, packet_of(i, utime, caster, made::flight(t)));
    record(log, channels::pose_estimate, estimate);
  }
  event_t event{};
  event.utime = made::start + 15 * second;
  event.session = made::session;
  event.node = "estimator";
  event.severity = event_t::WARNING;
  event.code = "lost";
  event.text = "\"><img src=x onerror=alert(1)>";
  record(log, channels::event, event);
  node_status_t status{};
  status.session = made::session;
  status.node = "estimator";
  for (const auto state : {node_status_t::READY, node_status_t::DEGRADED}) {
    status.utime = made::start + (state == node_status_t::READY ? 1 : 15) * second;
    status.state = state;
    status.reason = state == node_status_t::READY ? "" : "target lost";
    status.overflowed = 3;
    record(log, channels::node_status, status);
  }
  auto state = made::state({{"go", 0, 10}, {"hold", 10, 20}});
  state.outcome = procedure_state_t::FAIL;
  record(log, channels::procedure_state, state);
}

std::string section_of(const std::string& page, const std::string& id) {
  const auto begin = page.find("<section id=\"" + id + "\"");
  REQUIRE(begin != std::string::npos);
  return page.substr(begin, page.find("</section>", begin) - begin);
}

bool shows(const std::string& where, const std::string& what) {
  return where.find(what) != std::string::npos;
}

}  // namespace

TEST_CASE("a run's report shows what was, and nothing of its log becomes markup", "[report]") {
  const TemporaryDirectory folder;
  make_run(folder.path());
  const ReportedRun run = read_reported_runs(folder / "run.lcm", folder.path()).front();
  const fs::path file = folder / "report.html";
  write_report({&run, 1}, file);
  const std::string page = read_file(file);

  CHECK_FALSE(shows(page, "<script>alert"));
  CHECK_FALSE(shows(page, "<img"));
  CHECK_FALSE(shows(page, "<b>run</b>"));
  CHECK(shows(page, "<title>FAIL made &amp; &lt;b&gt;run&lt;/b&gt;</title>"));
  CHECK(shows(page, "class=\"verdict bad\""));
  CHECK(shows(page, "1 of 2 claims met</b>: A &amp; B"));
  const std::string claims = section_of(page, "claims");
  CHECK(shows(claims, "&lt;b&gt;below&lt;/b&gt; 2 mm"));
  CHECK(shows(claims, "\xE2\x9C\x97 not met"));
  CHECK(shows(claims, "\xE2\x9C\x93 met"));
  CHECK(shows(claims, "Figure &lt;3&gt;"));
  CHECK(shows(claims, "claimed: at most 2 mm"));
  CHECK(shows(claims, "peak position_error"));
  CHECK(shows(claims, "x, line: truth"));
  CHECK(shows(section_of(page, "criteria"), "&lt;i&gt;z&lt;/i&gt;"));
  CHECK(shows(section_of(page, "criteria"), "value bad"));
  CHECK(shows(section_of(page, "errors"), "span trouble"));
  CHECK(shows(section_of(page, "errors"), "lost: &lt;script&gt;"));
  CHECK(shows(section_of(page, "errors"), "mark\" data-x=\"15\""));
  CHECK(shows(section_of(page, "scans"), "the first lost"));
  CHECK(shows(section_of(page, "scans"), "amid go"));
  CHECK(shows(section_of(page, "events"), "&quot;&gt;&lt;img"));
  CHECK(shows(section_of(page, "nodes"), "DEGRADED"));
  CHECK(shows(section_of(page, "nodes"), ">3</b>"));
  CHECK(shows(section_of(page, "files"), "href=\"./run.lcm\""));
  CHECK(page.size() < 400000);
}

TEST_CASE("several runs are compared side by side with links to their own reports", "[report]") {
  const TemporaryDirectory folder;
  fs::create_directory(folder / "a");
  make_run(folder / "a");
  std::vector<ReportedRun> runs;
  runs.push_back(read_reported_runs(folder / "a" / "run.lcm", folder / "a").front());
  write_report({&runs.front(), 1}, folder / "a/report.html");
  runs.push_back(read_reported_runs(folder / "a" / "run.lcm").front());
  write_report(runs, folder / "both.html");
  const std::string page = read_file(folder / "both.html");
  CHECK(shows(page, "href=\"./a/report.html\""));
  CHECK(shows(section_of(page, "curves"), "go: position_error"));
  CHECK(shows(section_of(page, "measurements"), "rms z_error"));
  CHECK(shows(section_of(page, "figures"), "run 2 x, line: truth"));
  CHECK_THROWS_AS(write_report(runs, folder / "none/both.html"), InputError);
}

TEST_CASE("returns are distinguished by their side of the surface", "[report]") {
  const Mesh plate = make_box(Vector3d(2, 2, 0.01));
  const RayCaster caster(plate);
  const Pose at{Vector3d(0, 0, 5), Quaterniond::Identity()};
  const std::vector<Beam> beams = {
      {0, 4.995 - 0.02, 0, 0}, {0, 4.995 + 0.003, 0, 0}, {0, 0, 0, 0}, {0, 3, 0, 0}};
  const auto residuals = residuals_of(beams, caster, at, {}, 0, 0.5);
  CHECK(residuals[0] == Approx(-0.02).margin(1e-6));
  CHECK(residuals[1] == Approx(0.003).margin(1e-6));
  CHECK(std::isnan(residuals[2]));
  CHECK(std::isinf(residuals[3]));

  // The plate comes nearer at 1 m/s: a tenth of a second later it is 0.1 m nearer.
  Velocity nearer;
  nearer.linear.z() = -1;
  const auto moving = residuals_of({{100 * millisecond, 4.895, 0, 0}}, caster, at, nearer, 0, 0.5);
  CHECK(moving[0] == Approx(0).margin(1e-6));
}
