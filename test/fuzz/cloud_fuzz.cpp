// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "common/clouds/ptx_cloud.h"
#include "common/clouds/xyz_cloud.h"
#include "common/core/error.h"

using namespace berth;
using namespace berth::clouds;

namespace {

/// Every point is accounted for, and every beam is one that a sensor can have sent.
void check(const Cloud& cloud) {
  const CloudCounts& n = cloud.counts;
  if (n.points != n.hits + n.misses + n.undirected + n.not_finite + n.at_sensor + n.bad_sigma ||
      cloud.beams.size() != n.hits + n.misses) {
    std::abort();
  }
  for (const CloudBeam& beam : cloud.beams) {
    const bool hit = beam.hit;
    if (!std::isfinite(beam.azimuth) || !std::isfinite(beam.elevation) ||
        !std::isfinite(beam.range) || hit != (beam.range > 0) || !(beam.range_sigma >= 0)) {
      std::abort();
    }
  }
}

}  // namespace

/// First byte even: the rest is an XYZ file; odd: PTX.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
  try {
    check(data[0] % 2 == 0 ? parse_xyz(text, "fuzz") : parse_ptx(text, "fuzz"));
  } catch (const InputError&) {
  }
  return 0;
}
