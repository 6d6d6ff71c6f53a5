// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace berth {

/// Whether a parameter is a key of a configuration file and not one of the procedure:
/// "simulation_lidar.yaml:noise_scale", "lidars/ilris_3d.yaml:beam.range_sigma".
bool names_configuration(const std::string& parameter);

/// The parameters that are the procedure's own.
std::map<std::string, std::string> of_procedure(
    const std::map<std::string, std::string>& parameters);

/// Writes those that name a key into the files of a configuration directory; comments stay.
/// @throws InputError when there is no such file or key, or the value is of another kind than the
/// one it replaces.
void override_configuration(const std::filesystem::path& config,
                            const std::map<std::string, std::string>& parameters);

/// The same without writing anything.
void check_override(const std::filesystem::path& config, const std::string& parameter,
                    const std::string& value);

/// Makes a calibration file the one of a layout; an empty name changes nothing.
/// @throws InputError when it cannot be read.
void put_calibration(const std::filesystem::path& config, const std::string& layout,
                     const std::filesystem::path& file);

/// A configuration directory with some keys changed, or a calibration; where none are it is the one
/// given, else a copy that goes with this object.
class ChangedConfiguration {
 public:
  /// @throws InputError as override_configuration
  ChangedConfiguration(const std::filesystem::path& config,
                       const std::map<std::string, std::string>& parameters,
                       const std::string& layout = "",
                       const std::filesystem::path& calibration = "");
  ~ChangedConfiguration();
  ChangedConfiguration(const ChangedConfiguration&) = delete;
  ChangedConfiguration& operator=(const ChangedConfiguration&) = delete;

  const std::filesystem::path& directory() const { return directory_; }

 private:
  std::filesystem::path directory_;
  bool is_copy_ = false;
};

}  // namespace berth
