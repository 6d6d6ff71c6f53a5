// SPDX-License-Identifier: BSD-3-Clause
// What the LIDAR and the estimator are asked for.
#include <algorithm>

#include "common/core/positive.h"
#include "procedures/language/verb_families.h"

namespace berth::procedures {
namespace {

const std::vector<std::string> patterns = {"raster", "spiral", "rosette", "lissajous"};

const KeyInfo gate_key = {"gate", Kind::gate, false, "the estimator's own",
                          "range gate, such as [3 m, 8 m]"};

const KeyInfo returns_key = {"returns", Kind::count, false, "the estimator's own choice",
                             "returns asked for in each scan"};

const KeyInfo acquire_returns_key = {"returns", Kind::count, false, "as they come",
                                     "returns wanted of the scan in which it is found"};

void optional_count(Config& config, const std::string& key, int& value) {
  config.optional(key, value);
  expect_not_negative(config, key, value);
}

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
  window.width = positive(config, "width", Dimension::angle);
  window.height = positive(config, "height", Dimension::angle);
  window.count = config.small_integer("count");
  if (window.count < 1) throw config.error("count", "expected at least one beam");
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
  optional_count(config, "returns", acquire.returns);
  return {acquire, 90};
}

Read read_track(Config& config) {
  Track track;
  optional_gate(config, track.gate_near, track.gate_far);
  config.optional("strategy", track.strategy);
  optional_count(config, "returns", track.returns);
  config.optional("settle", track.settle);
  if (track.settle < 1) throw config.error("settle", "expected at least one good estimate");
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
       "the estimator asks for no more scans",
       "20 s",
       {},
       nullptr,
       std::nullopt,
       read_stop_tracking},
  };
}

}  // namespace berth::procedures
