// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "drivers/lidar/protocol.h"

namespace berth::lidar {

/// Those of one kind, in their order.
template <class Kind>
std::vector<Kind> all_of(const std::vector<Message>& messages) {
  std::vector<Kind> found;
  for (const Message& message : messages) {
    if (const auto* m = std::get_if<Kind>(&message)) found.push_back(*m);
  }
  return found;
}

}  // namespace berth::lidar
