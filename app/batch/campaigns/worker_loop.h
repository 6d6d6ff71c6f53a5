// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/runner.h"

namespace berth::campaigns {

/// What a worker process does until there are no more blocks. It hears lines "BEGIN END" and says
/// lines: "ready", "had N" of trials that an earlier worker did, "trial" for each of its own,
/// "block" when a block's file is on the disk. What goes wrong with the files is thrown.
void work(const Campaign& campaign, Experiment& experiment, int blocks, int news);

/// One line to a pipe; a parent that is gone is not our concern.
void say(int to, const std::string& line);

}  // namespace berth::campaigns
