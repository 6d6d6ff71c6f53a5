// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/manifest.h"
#include "evaluation/report/html.h"

namespace berth::campaigns {

struct NamedDirection {
  Vector3d on_map;  ///< as viewing_direction() of sphere_map.h
  std::string caption;
};

/// The attitude (model to sensor frame) in which the target is seen from there, upright.
Quaterniond upright_attitude(const Vector3d& on_map);

/// Pictures of a target from some directions. @throws InputError without its mesh.
report::Html views_of(const CampaignTarget& target, const std::vector<NamedDirection>& directions);

}  // namespace berth::campaigns
