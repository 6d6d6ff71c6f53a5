// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/reflectors.h"

#include <set>

#include "common/core/positive.h"

namespace berth {

TrackerSetup load_tracker_setup(const std::filesystem::path& file) {
  Config config = Config::load(file);
  TrackerSetup setup;
  setup.sigma = positive(config, "sigma", Dimension::length);
  setup.sigma_per_metre = positive(config, "sigma_per_metre", Dimension::length);
  setup.time_sigma = positive(config, "time_sigma", Dimension::time);
  std::set<std::string> names;
  int count[2] = {0, 0};
  for (Config entry : config.sections("reflectors")) {
    Reflector reflector;
    reflector.name = entry.text("name");
    if (!names.insert(reflector.name).second) {
      throw entry.error("name", "there is another reflector '" + reflector.name + "'");
    }
    reflector.on =
        entry.choice("on", {"replica", "sensor"}) == "replica" ? ArmRole::replica : ArmRole::sensor;
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
