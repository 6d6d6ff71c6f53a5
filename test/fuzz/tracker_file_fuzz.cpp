// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "common/core/error.h"
#include "testbed/calibration/tracker_file.h"

using namespace berth;

namespace {

TrackerSetup made_setup() {
  TrackerSetup setup;
  for (const char* name : {"S1", "S2", "R1"}) {
    Reflector reflector{};
    reflector.name = name;
    setup.reflectors.push_back(reflector);
  }
  return setup;
}

}  // namespace

/// What is read is a number of a reflector that there is; all else is refused.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TrackerSetup setup = made_setup();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    for (const testbed::TrackerLine& line : testbed::parse_tracker_file(text, "fuzz", setup)) {
      if (line.reflector >= setup.reflectors.size() || !std::isfinite(line.time) ||
          !line.point.allFinite()) {
        std::abort();
      }
    }
  } catch (const InputError&) {
  }
  return 0;
}
