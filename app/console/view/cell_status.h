// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/console/view/latest_messages.h"

namespace berth::console {

/// What is read from three metres.
struct CellStatus {
  std::string word;  ///< "stop", "attention", "held", "moving" or "safe"
  std::string why;
};

/// One word for the whole cell; the first of these that is so:
///   stop       the E-stop chain or the fence is open, an arm's controller has a fault or its
///              E-stop, or the testbed has a fault: nothing can move until somebody acts
///   attention  nobody is heard, a node is silent, has a fault or says it is degraded, the PLC does
///              not answer, the estimate is lost while it is flown by, or an operator is asked
///   held       the procedure or the motion is held and waits
///   moving     an arm moves, or a motion is being carried out
///   safe       none of these
/// The word describes; what makes the cell safe is its PLC and its controllers.
CellStatus cell_status(const LatestMessages& latest, Utime now);

}  // namespace berth::console
