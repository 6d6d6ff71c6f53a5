// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/perturbed_kinematics.h"

namespace berth {

PerturbedKinematics::PerturbedKinematics(std::shared_ptr<const ArmKinematics> nominal,
                                         const std::array<Pose, 6>& links)
    : nominal_(std::move(nominal)), links_(links) {
  name_ = nominal_->name();
  limits_ = nominal_->limits();
  for (std::size_t i = 0; i < 6; ++i) linear_[i] = nominal_->is_linear(static_cast<int>(i));
  bodies_ = nominal_->bodies();
}

std::array<Pose, 7> PerturbedKinematics::link_poses(const Joints& joints) const {
  const std::array<Pose, 7> nominal = nominal_->link_poses(joints);
  std::array<Pose, 7> links;
  links[0] = nominal[0];
  for (std::size_t i = 1; i < links.size(); ++i) {
    links[i] = links[i - 1] * (nominal[i - 1].inverse() * nominal[i]) * links_[i - 1];
  }
  return links;
}

Pose PerturbedKinematics::forward(const Joints& joints) const { return link_poses(joints)[6]; }

}  // namespace berth
