// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "common/clouds/cloud.h"
#include "common/core/error.h"

using namespace berth;
using namespace berth::clouds;

namespace {

/// Every point is accounted for, and every beam is one that a sensor can have sent.
void check(const Cloud& cloud) {
  const CloudCounts& n = cloud.counts;
  if (n.points != n.hits + n.misses + n.undirected + n.not_finite + n.at_sensor + n.later_returns ||
      n.points == 0 || cloud.beams.size() != n.hits + n.misses) {
    std::abort();
  }
  for (const CloudBeam& beam : cloud.beams) {
    const bool hit = beam.hit;
    if (!std::isfinite(beam.azimuth) || !std::isfinite(beam.elevation) ||
        !std::isfinite(beam.range) || hit != (beam.range > 0) || !(beam.range_sigma >= 0) ||
        !std::isfinite(beam.range_sigma) || (!cloud.has_times && beam.utime != 0)) {
      std::abort();
    }
  }
}

}  // namespace

/// The first byte selects the format of the rest: 'x' XYZ, 'p' PCD, 'l' PLY, 't' PTX; capital: its
/// times are in ns. test/fuzz/corpus/cloud has some of each.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  CloudOptions options;
  if (data[0] < 'a') options.us_per_time = 1e-3;
  const char* extension = nullptr;
  switch (data[0] | 0x20) {
    case 'x':
      extension = ".xyz";
      break;
    case 'p':
      extension = ".pcd";
      break;
    case 'l':
      extension = ".ply";
      break;
    case 't':
      extension = ".ptx";
      break;
    default:
      return 0;
  }
  try {
    check(parse_cloud({reinterpret_cast<const char*>(data + 1), size - 1}, extension, "fuzz",
                      options));
  } catch (const InputError&) {
  }
  return 0;
}
