// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/yaml.h"

namespace berth {

/// The estimator.yaml of a run recorded before, with what replaces the keys and methods that are no
/// more. The same node where it has none of them.
YamlNode with_present_keys(const YamlNode& estimator);

}  // namespace berth
