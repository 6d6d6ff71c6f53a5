// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/process_loop.h"
#include "drivers/lidar/tcp_adapter.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "test/catch.h"
#include "test/free_port.h"
#include "test/lidar/lidar_fixture.h"
#include "test/lidar/wall_scene.h"

using namespace berth;

TEST_CASE("driver and device speak over real TCP") {
  ProcessLoop loop(clock_offset_now());
  WallScene scene(loop.now());
  const std::string address = free_address();
  LidarProfile profile = ilris();
  profile.rate_hz = 100000;  // a long scan in little time, with frames that fill socket buffers
  SimulatedLidarSettings settings;
  settings.beams_per_packet = static_cast<int>(lidar::max_beams_per_message);
  settings.clock_offset = 5 * second;
  SimulatedLidar device(address, profile, settings, 1, loop, scene);

  lidar::TcpSettings link_settings;
  link_settings.address = address;
  link_settings.model = "ILRIS-3D";
  std::uint32_t beams = 0;
  std::optional<lidar::ScanEnd> end;
  lidar::TcpAdapter link(link_settings, loop);
  link.start(lidar::Adapter::Events{
      [&] {
        link.order({1, {{0, 0, 0.1, 0.1, lidar::Pattern::raster, 30000, 0}}});
      },
      [&](const lidar::Message& message) {
        if (const auto* returns = std::get_if<lidar::Returns>(&message)) {
          CHECK(returns->beams_before == beams);
          beams += static_cast<std::uint32_t>(returns->beams.size());
        }
        if (const auto* e = std::get_if<lidar::ScanEnd>(&message)) {
          end = *e;
          loop.stop();
        }
      },
      [&](const std::string& reason) {
        FAIL_CHECK(reason);
        loop.stop();
      }});
  loop.after(60 * second, [&] { loop.stop(); });  // a hang must not hang the test
  loop.run();
  REQUIRE(end);
  CHECK(end->result == lidar::ScanResult::complete);
  CHECK(beams == 30000);
  CHECK(std::abs(seconds(link.clock().offset) - 5) < 1);
}
