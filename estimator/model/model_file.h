// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "estimator/model/target_model.h"

namespace berth::estimator {

/// The compiled part of a TargetModel as a file of this machine's byte order, with a checksum.
class ModelFile {
 public:
  /// "<64 hex digits>.model": a hash over mesh, options and format version.
  static std::string name(const Target& target, const ModelOptions& options);
  /// Fills the compiled members.
  /// @return false, with the model unusable, when the file is missing or damaged.
  static bool read(const std::filesystem::path& path, TargetModel& model);
  /// Under a temporary name, then renamed. @return false when the file cannot be written.
  static bool write(const std::filesystem::path& path, const TargetModel& model);
};

}  // namespace berth::estimator
