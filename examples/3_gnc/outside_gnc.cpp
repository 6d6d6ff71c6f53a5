// SPDX-License-Identifier: BSD-3-Clause
// A guidance outside of Berth: it receives POSE_ESTIMATE, and publishes by GUIDANCE_SETPOINT
// how the chaser is to move. Needs liblcm and the messages of lcmtypes/, nothing else of Berth.
//
//   ./berth run procedures/outside_gnc.yaml                     (one terminal)
//   build/release/examples/outside_gnc [--lcm-url URL]          (another)
//
// The procedure's step `guided: {by: my-gnc, ...}` lets it steer, and ends it.
#include <algorithm>
#include <berth/guidance_setpoint_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <cmath>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <string>
#include <vector>

namespace {

constexpr double standoff = 3.6;      // m, from the sensor to the model's origin
constexpr double speed = 0.03;        // m/s, at most
constexpr double gain = 0.2;          // 1/s
constexpr int64_t lifetime = 500000;  // us: a set-point that is not followed by another brings rest
constexpr int64_t freshness = 3000000;  // us: older estimates are not flown by

class Gnc {
 public:
  explicit Gnc(lcm::LCM& lcm) : lcm_(lcm) {
    lcm_.subscribe("POSE_ESTIMATE", &Gnc::on_estimate, this);
    lcm_.subscribe("TESTBED_STATE", &Gnc::on_state, this);
  }

 private:
  void on_estimate(const lcm::ReceiveBuffer*, const std::string&,
                   const berth::pose_estimate_t* estimate) {
    estimate_ = *estimate;
  }

  // Ten times a second, and it carries the cell's clock.
  void on_state(const lcm::ReceiveBuffer*, const std::string&,
                const berth::testbed_state_t* state) {
    const bool usable = estimate_.status == berth::pose_estimate_t::OK &&
                        estimate_.session == state->session &&
                        state->utime - estimate_.utime < freshness;
    if (!usable) return;  // without set-points the chaser comes to rest

    // The target is at p in the sensor frame (x right, y down, z along the boresight). Moving the
    // sensor by v moves the target by -v: to centre it, go where it is; to come nearer, go along z.
    const double* p = estimate_.position_m;
    const double velocity[3] = {gain * p[0], gain * p[1], gain * (p[2] - standoff)};
    const double length = std::hypot(velocity[0], velocity[1], velocity[2]);
    const double scale = length > speed ? speed / length : 1;

    berth::guidance_setpoint_t setpoint{};
    setpoint.utime = state->utime;
    setpoint.seq = ++seq_;
    setpoint.session = state->session;
    setpoint.utime_expires = state->utime + lifetime;
    setpoint.commander = "my-gnc";
    for (int i = 0; i < 3; ++i) setpoint.linear_velocity_m_s[i] = scale * velocity[i];
    lcm_.publish("GUIDANCE_SETPOINT", &setpoint);
    if (seq_ % 10 == 0) std::printf("target at %+.3f %+.3f %.3f m\n", p[0], p[1], p[2]);
  }

  lcm::LCM& lcm_;
  berth::pose_estimate_t estimate_{};
  int64_t seq_ = 0;
};

}  // namespace

/// @param arguments an LCM URL; without one LCM_DEFAULT_URL, or LCM's own
int main(int count, char** arguments) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::vector<std::string> words(arguments + 1, arguments + count);
  const bool has_url = words.size() == 2 && words[0] == "--lcm-url";
  if (!words.empty() && !has_url) {
    const bool help = words[0] == "--help";
    std::fprintf(help ? stdout : stderr, "usage: outside_gnc [--lcm-url URL]\n");
    return help ? 0 : 2;
  }
  const std::string url = has_url ? words[1] : "";
  lcm::LCM lcm(url);
  if (!lcm.good()) {
    std::fprintf(stderr, "outside_gnc: no LCM at '%s'\n", url.c_str());
    return 2;
  }
  Gnc gnc(lcm);
  while (lcm.handle() == 0) {
  }
  return 2;
}
