// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace berth {

/// What a list shows of one run directory, from its small files: no log is read.
struct RunEntry {
  enum class State { running, finished, unfinished };

  std::filesystem::path directory;
  std::string created;  ///< "2026-11-21T13:32:29Z"
  std::string host;
  std::string procedure;  ///< empty: a cell without one
  std::string layout;
  std::string target;
  std::string version;
  std::string operator_name;
  std::int64_t seed = 0;
  State state = State::unfinished;
  std::string outcome;  ///< "PASS" ...; empty unless finished
  std::string reason;   ///< of the outcome, or why there is none
  double duration_s = 0;
  /// Of the criteria, the one that is nearest to its limit for its size, or farthest beyond.
  std::string worst_criterion;
  double worst_margin = 0;
  std::string worst_unit;
  std::uintmax_t bytes = 0;

  std::string name() const { return directory.filename().string(); }
};

/// Never throws: what cannot be read is the entry's reason.
RunEntry read_run_entry(const std::filesystem::path& directory);

/// All run directories in this one, oldest first. @throws InputError when there is no such place.
std::vector<RunEntry> list_runs(const std::filesystem::path& parent);

struct RunFilter {
  std::string procedure;  ///< part of its name
  std::string outcome;    ///< "FAIL", "RUNNING", "UNFINISHED" ..., any case
  std::string host;
  std::string since;  ///< "2026-11-20", "2026-11-20T08:00", "12 h", "3 days"
};

/// Those that match; the newest `limit` of them (0: all), oldest first.
/// @throws InputError for a time that is none.
std::vector<RunEntry> matching(const std::vector<RunEntry>& runs, const RunFilter& filter,
                               std::size_t limit);

/// "PASS" ..., "RUNNING" or "UNFINISHED".
std::string state_text(const RunEntry& run);

/// The run that a user names: a directory or a log; else one in `parent` whose name has this in it;
/// "last": the newest. @throws InputError when there is none, or more than one.
std::filesystem::path find_run(const std::string& text,
                               const std::filesystem::path& parent = "runs");
/// Its log. @throws InputError when there is none.
std::filesystem::path log_of_run(const std::string& text,
                                 const std::filesystem::path& parent = "runs");
/// Its directory, of a log the one that it is in. @throws InputError when that is no run's.
std::filesystem::path directory_of_run(const std::string& text,
                                       const std::filesystem::path& parent = "runs");

/// The outcome in results.json; nothing when there is none.
std::optional<std::int8_t> recorded_outcome(const std::filesystem::path& directory);

}  // namespace berth
