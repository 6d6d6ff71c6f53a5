// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/reflectors.h"

#include <set>

#include "common/core/config.h"

namespace berth {

TrackerSetup load_tracker_setup(const std::filesystem::path& file) {
  Config config = Config::load(file);
  TrackerSetup setup;
  setup.sigma = config.quantity("sigma", Dimension::length, above(0));
  setup.sigma_per_metre = config.quantity("sigma_per_metre", Dimension::length, above(0));
  setup.time_sigma = config.quantity("time_sigma", Dimension::time, above(0));
  std::set<std::string> names;
  int count[2] = {0, 0};
  for (Config entry : config.sections("reflectors")) {
    Reflector reflector;
    reflector.name = entry.text("name");
    if (!names.insert(reflector.name).second) {
      throw entry.error("name", "there is another reflector '" + reflector.name + "'");
    }
    reflector.on =
        entry.choice<ArmRole>("on", {{"replica", ArmRole::replica}, {"sensor", ArmRole::sensor}});
    reflector.place = entry.vector("at", Dimension::length);
    entry.finish();
    ++count[reflector.on == ArmRole::replica ? 0 : 1];
    setup.reflectors.push_back(std::move(reflector));
  }
  config.finish();
  if (count[0] < 3 || count[1] < 3) {
    throw config.error("reflectors", "expected at least three on the replica and on the sensor");
  }
  return setup;
}

}  // namespace berth
