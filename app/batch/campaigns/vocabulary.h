// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "app/batch/campaigns/manifest.h"

namespace berth::campaigns {

/// What the experiment of a manifest may be told, and what can be kept of it.
class Vocabulary {
 public:
  virtual ~Vocabulary() = default;

  /// @throws InputError when there is no such parameter, or the value is none for it.
  virtual void check(const std::string& name, const std::string& value) const = 0;
  /// Parameters that must be given.
  virtual std::vector<std::string> required() const = 0;
  /// A measurement as a manifest names it. @throws InputError.
  virtual KeptMeasurement measurement(const std::string& text) const = 0;
};

/// @throws InputError where what is named is not there.
std::unique_ptr<Vocabulary> vocabulary_of_procedure(const Places& places);
std::unique_ptr<Vocabulary> vocabulary_of_acquisition(const Places& places);

/// "p95 position_error in hold". @throws InputError.
KeptMeasurement measurement_of_run(const std::string& text, const std::vector<std::string>& phases);

}  // namespace berth::campaigns
