// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/node_status_t.hpp>
#include <map>
#include <optional>
#include <string>

#include "evaluation/run/truth_track.h"
#include "lcmtypes/latest_messages.h"
#include "logs/file/log_event.h"

namespace berth::console {

/// The latest messages that more than one section needs.
struct CellMessages : LatestMessages {
  std::optional<evaluation::TruthSample> truth;
  std::map<std::string, node_status_t> nodes;
  std::map<std::string, Utime> beats;  ///< when each node's heartbeat was last received

  /// A message of a foreign type, or a damaged one, changes nothing.
  void take(const logs::LogEvent& event);
  /// Truth, unless it is older than a second.
  std::optional<evaluation::TruthSample> truth_at(Utime now) const;
};

/// The status that is read from three metres.
struct CellStatus {
  std::string word;  ///< "stop", "attention", "held", "moving" or "safe"
  std::string why;
};

/// One word for the whole cell; the first of these that is so:
///   stop       the E-stop chain or the fence is open, an arm's controller has a fault or its
///              E-stop, or the testbed has a fault: nothing can move until somebody acts
///   attention  no heartbeat from any node, a node is silent, has a fault or reports that it is
///              degraded, the PLC does not answer, the estimate is lost while it is flown by, or
///              an operator is prompted
///   held       the procedure or the motion is held and waits
///   moving     an arm moves, or a motion is being carried out
///   safe       none of these
/// The word describes; what makes the cell safe is its PLC and its controllers.
CellStatus cell_status(const CellMessages& latest, Utime now);

}  // namespace berth::console
