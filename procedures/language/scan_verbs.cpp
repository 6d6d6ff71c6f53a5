// SPDX-License-Identifier: BSD-3-Clause
// Verbs for the LIDAR and the estimator.
#include <algorithm>

#include "procedures/language/verbs.h"

namespace berth::procedures {
namespace {

const std::vector<std::string> patterns = {"raster", "spiral", "rosette", "lissajous"};

const KeyInfo gate_key = {"gate", Kind::gate, false, "the estimator's own",
                          "range gate, such as [3 m, 8 m]"};

const KeyInfo returns_key = {"returns", Kind::count, false, "the estimator's own choice",
                             "returns requested in each scan"};

const KeyInfo acquire_returns_key = {"returns", Kind::count, false, "as they come",
                                     "returns requested in the scan that finds the target"};

void optional_gate(Config& config, double& near, double& far) {
  if (!config.has("gate")) return;
  const auto gate = config.quantities("gate", Dimension::length);
  if (gate.size() != 2 || gate[0] < 0 || gate[1] <= gate[0]) {
    throw config.error("gate", "expected [near, far], such as [3 m, 8 m]");
  }
  near = gate[0];
  far = gate[1];
}

Read read_scan(Config& config) {
  Scan scan;
  Window& window = scan.window;
  window.name = "procedure";
  config.optional("azimuth", Dimension::angle, window.azimuth);
  config.optional("elevation", Dimension::angle, window.elevation);
  window.width = config.quantity("width", Dimension::angle, above(0));
  window.height = config.quantity("height", Dimension::angle, above(0));
  window.count = config.small_integer("count", at_least(1));
  if (config.has("pattern")) {
    const auto found =
        std::find(patterns.begin(), patterns.end(), config.choice("pattern", patterns));
    window.pattern = static_cast<Pattern>(found - patterns.begin());
  }
  return {scan, 120};
}

Read read_acquire(Config& config) {
  Acquire acquire;
  optional_gate(config, acquire.gate_near, acquire.gate_far);
  config.optional("returns", acquire.returns, at_least(0));
  return {acquire, 90};
}

Read read_track(Config& config) {
  Track track;
  optional_gate(config, track.gate_near, track.gate_far);
  config.optional("strategy", track.strategy);
  config.optional("returns", track.returns, at_least(0));
  config.optional("settle", track.settle, at_least(1));
  if (config.has("from")) track.from = config.pose("from");
  return {track, 60};
}

Read read_stop_tracking(Config& step) {
  expect_nothing(step, "stop_tracking");
  return {StopTracking{}, 20};
}

}  // namespace

std::vector<VerbInfo> scan_verbs() {
  return {
      {"scan",
       "one scan of the procedure's own; wants no tracking at the time",
       "2 min",
       {{"azimuth", Kind::angle, false, "0 deg", "of the window's middle, to the right"},
        {"elevation", Kind::angle, false, "0 deg", "of the window's middle, down"},
        {"width", Kind::angle, true, "", "full width"},
        {"height", Kind::angle, true, "", "full height"},
        {"count", Kind::count, true, "", "beams"},
        {"pattern", Kind::words, false, "raster", "path of the beam", patterns}},
       read_scan},
      {"acquire",
       "looks for the target; done with the first good estimate",
       "90 s",
       {gate_key, acquire_returns_key},
       read_acquire},
      {"track",
       "tracks on; done after some good estimates in a row",
       "60 s",
       {gate_key,
        returns_key,
        {"strategy", Kind::text, false, "the estimator's own", "where the LIDAR looks"},
        {"settle", Kind::count, false, "3", "good estimates in a row"},
        {"from", Kind::pose, false, "where it was last seen",
         "where the target should be now, to 5 cm and 3 degrees"}},
       read_track},
      {"stop_tracking",
       "the estimator requests no more scans",
       "20 s",
       {},
       nullptr,
       std::nullopt,
       read_stop_tracking},
  };
}

}  // namespace berth::procedures
