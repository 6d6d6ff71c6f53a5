// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/console/view/section.h"
#include "logs/types/type_catalogue.h"

namespace berth::console {

/// A recorded run in the console, alone or compared with a second one: plays their logs into the
/// board's sections (PROTOCOL.md, `replay`). Knows no clock: wall times are those of any clock in
/// us.
///
///     loop.every(20 * millisecond, [&] { replay.run(loop.now()); });
///     answer.text = replay.obey(command.name, command.arguments, loop.now());
class ReplaySource {
 public:
  /// The board must keep so many `samples`: those of the whole run.
  static constexpr std::size_t max_samples = 100000;

  /// Receives how much of the logs was read, 0 to 1.
  using Progress = std::function<void(double)>;

  /// Reads the logs once; writes what does not change and the samples of the whole runs; stands at
  /// the start and plays. types and sink must outlive it.
  /// @param second a run to be compared with the first; empty: none
  /// @throws InputError for what is no run directory, or has no log
  ReplaySource(const std::filesystem::path& run, const std::filesystem::path& second,
               const logs::TypeCatalogue& types, Sink& sink, Utime wall,
               const Progress& progress = {});
  ~ReplaySource();
  ReplaySource(const ReplaySource&) = delete;
  ReplaySource& operator=(const ReplaySource&) = delete;

  /// The meshes of the scene by the paths at which they are served; application/json.
  std::map<std::string, std::string> meshes() const;

  /// Shows everything that is due. Call at least as often as the page is to move.
  void run(Utime wall);

  /// `play`, `pause`, `seek {position_s}`, `rate {factor}`, `step {channel}` (without one: by
  /// event), `loop {on}`. @return what was done, for a person
  /// @throws InputError for another command, or for arguments that are not those
  std::string obey(const std::string& command, const nlohmann::json& arguments, Utime wall);

  double position_s(Utime wall) const;
  double length_s() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth::console
