// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/filter/motion_information.h"

namespace berth::estimator {

Motion perturbed(const Motion& motion, const Vector12d& d) {
  Motion result = motion;
  result.pose = berth::perturbed(motion.pose, d.head<6>());
  result.velocity.linear += d.segment<3>(6);
  result.velocity.angular += d.tail<3>();
  return result;
}

Vector12d difference(const Motion& from, const Motion& to) {
  Vector12d d;
  d << berth::difference(from.pose, to.pose), to.velocity.linear - from.velocity.linear,
      to.velocity.angular - from.velocity.angular;
  return d;
}

}  // namespace berth::estimator
