// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace berth {

/// A supervisor that is running now on this machine, for this user.
struct ActiveRun {
  pid_t supervisor = 0;
  std::filesystem::path directory;
  std::string url;
};

/// Whether the process still runs: one that has ended and waits to be reaped does not.
bool is_alive(pid_t pid);

/// All of them, newest last. Entries of dead supervisors are removed.
std::vector<ActiveRun> active_runs();
/// The newest, or the one in the directory given.
std::optional<ActiveRun> find_active_run(const std::filesystem::path& directory = {});

/// The same. @throws InputError when there is none.
ActiveRun require_active_run(const std::filesystem::path& directory = {});

/// Lists the calling process as long as it lives.
class ActiveRunEntry {
 public:
  ActiveRunEntry(const std::filesystem::path& directory, const std::string& url);
  ~ActiveRunEntry();
  ActiveRunEntry(const ActiveRunEntry&) = delete;
  ActiveRunEntry& operator=(const ActiveRunEntry&) = delete;

 private:
  std::filesystem::path file_;
};

}  // namespace berth
