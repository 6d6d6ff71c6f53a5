// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/core/lidar_profile.h"
#include "common/core/random.h"
#include "drivers/lidar/connection.h"
#include "drivers/lidar/scan_pattern.h"
#include "drivers/simulated/lidar/mirror.h"
#include "drivers/simulated/receiver/receiver.h"
#include "drivers/simulated/receiver/scene.h"

namespace berth {

/// Deviations of the simulated LIDAR from its profile, and properties that no profile has:
/// config/simulation_lidar.yaml.
struct SimulatedLidarSettings {
  std::string serial = "simulated";
  Utime start_delay = 5 * millisecond;  ///< from a scan order to the first beam
  MirrorSettings mirror;                ///< between the windows of a scan, and before the first
  int beams_per_packet = 50;
  std::int64_t clock_offset = 0;  ///< device clock minus host clock at the start, us
  double clock_drift = 0;         ///< parts of one
  ReceiverSettings receiver;
  SceneSettings scene;
};

/// Faults of a simulated LIDAR; each lasts until it is cleared.
struct LidarFaults {
  bool silent = false;     ///< measures on and answers nothing
  bool blackout = false;   ///< every beam is a MISS
  double range_bias = 0;   ///< m, added to every range
  double noise_scale = 1;  ///< on all three sigmas
  double range_noise = 1;  ///< on the sigma of range, in addition
  double angle_noise = 1;  ///< on those of both angles, in addition
  double dropout = 0;      ///< share of the returns that are lost
  double speed = 1;        ///< share of the rated beams per second, from the next scan on
};

/// @throws InputError.
SimulatedLidarSettings load_simulated_lidar(const std::filesystem::path& file);

/// A scanning LIDAR that speaks drivers/lidar/PROTOCOL.md to one host. Beams are fired at the
/// profile's rate, each cast into the scene as it was when the beam left; one timer per packet.
/// Between windows the mirror turns (mirror.h). The receiver (receiver.h) models the return of a
/// beam. Faults have a random stream of their own: beams without a fault are the same as in a run
/// without faults.
class SimulatedLidar {
 public:
  SimulatedLidar(const std::string& address, LidarProfile profile, SimulatedLidarSettings settings,
                 std::uint64_t seed, Loop& loop, Scene& scene);
  ~SimulatedLidar();
  SimulatedLidar(const SimulatedLidar&) = delete;
  SimulatedLidar& operator=(const SimulatedLidar&) = delete;

  LidarFaults& faults() { return faults_; }
  std::int64_t beams_fired() const { return beams_fired_; }

 private:
  struct Scan {
    std::int64_t id = 0;
    std::vector<lidar::ScanPattern> windows;
    std::size_t window = 0;
    double rate_hz = 0;
    std::int64_t next = 0;    // beam of this window
    Utime window_start = 0;   // when its first beam is fired
    std::uint32_t beams = 0;  // sent
    bool over = false;        // ended; kept for its id
  };

  void accept(std::unique_ptr<lidar::Connection> connection);
  void receive(const lidar::Message& message);
  void greet(const lidar::Hello& hello);
  void take_order(const lidar::ScanOrder& order);
  void answer_status(std::uint32_t token);
  void aim_at_window(Utime from);
  void schedule_packet();
  void measure_packet();
  lidar::BeamReturn measure(const lidar::BeamAngles& angles, Utime t, const Sunlight& sun);
  void add_faults(lidar::BeamReturn& measured);
  void end(lidar::ScanResult result);
  void stop();
  void send(const lidar::Message& message);
  bool scanning() const { return scan_ && !scan_->over; }
  Utime fired_at(std::int64_t beam) const;
  std::int64_t device_time(Utime t) const;

  LidarProfile profile_;
  SimulatedLidarSettings settings_;
  Receiver receiver_;
  Random fault_random_;
  Loop& loop_;
  Scene& scene_;
  Utime started_;
  std::unique_ptr<lidar::Connection> connection_;
  bool greeted_ = false;
  LidarFaults faults_;
  std::optional<Scan> scan_;
  Loop::TimerId packet_timer_ = 0;
  std::int64_t beams_fired_ = 0;
  lidar::BeamAngles aim_;  // of the mirror when the last window ended
  lidar::Returns packet_;
};

}  // namespace berth
