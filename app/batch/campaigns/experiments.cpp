// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/experiments.h"

namespace berth::campaigns {

std::unique_ptr<Experiment> make_experiment(const Campaign& campaign) {
  return campaign.manifest().experiment == "procedure" ? make_procedure_experiment(campaign)
                                                       : make_acquisition_experiment(campaign);
}

}  // namespace berth::campaigns
