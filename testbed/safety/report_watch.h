// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

/// What a device or the estimator says and cannot be so.
struct Contradiction {
  std::string code;  ///< stable name, for events
  std::string text;  ///< for the operator
};

/// Looks at what one controller reports, sample after sample: no joint is faster than its motor
/// lets it, and a clock does not go back unless its controller was started anew.
class ReportWatch {
 public:
  struct Report {
    std::int64_t utime = 0;            ///< us, at which the joints were so
    std::int64_t controller_time = 0;  ///< us, the controller's own clock, unwrapped
    Joints joints{};
    Joints sigma{};  ///< 1 sigma of each
  };

  ReportWatch(std::string name, const ArmKinematics& arm) : name_(std::move(name)), arm_(arm) {}

  /// Valid reports only, in their order.
  std::optional<Contradiction> look(const Report& report);

 private:
  std::string name_;
  const ArmKinematics& arm_;
  std::optional<Report> last_;
};

}  // namespace berth::testbed
