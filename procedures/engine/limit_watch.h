// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/criterion_result_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "procedures/engine/live_quantity.h"
#include "procedures/language/limit.h"

namespace berth::procedures {

/// Watches the limits of a procedure.
class LimitWatch {
 public:
  struct Broken {
    Limit::Then then;
    std::string text;  ///< "limit 'never too near': surface_range 2.950 m, not below 3.000 m"
  };

  explicit LimitWatch(std::vector<Limit> limits);

  /// Evaluates the limits that apply to this step.
  /// @return the gravest of those that are newly broken: fail and abort before hold
  std::optional<Broken> look(const RunMessages& live, int step, const std::string& phase);
  /// The limits that are broken now, as text; empty: none.
  std::string broken_now() const;
  /// Values and limits of the last evaluation, for observers.
  const std::vector<criterion_result_t>& results() const { return results_; }

 private:
  struct Watched {
    Limit limit;
    Utime broken_since = 0;  // 0: it is kept
    bool broken = false;     // for long enough
  };

  std::vector<Watched> watched_;
  std::vector<criterion_result_t> results_;
};

}  // namespace berth::procedures
