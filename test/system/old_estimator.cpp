// SPDX-License-Identifier: BSD-3-Clause
// A library whose interface is of another version than that of the program which loads it.
#include "estimator/node/estimator_plugin.h"

extern "C" const berth::EstimatorPlugin* berth_estimator_plugin() {
  static const berth::EstimatorPlugin plugin{berth::estimator_plugin_version + 1, nullptr};
  return &plugin;
}
