// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace berth {

/// A supervisor that is running now on this machine, for this user. The proof is a lock (flock) on
/// its entry, which the kernel drops when the process ends, however it ends; a process number alone
/// proves nothing, as another program may have it by now.
struct ActiveRun {
  pid_t supervisor = 0;
  std::filesystem::path directory;
  std::string url;
};

/// All of them, newest last. Entries whose lock is free are removed. Empty where the list cannot be
/// read: then nothing can have been entered there either.
std::vector<ActiveRun> active_runs();
/// Whether the run is in the list still.
bool is_active(const ActiveRun& run);
/// The newest, or the one in the directory given.
std::optional<ActiveRun> find_active_run(const std::filesystem::path& directory = {});

/// The same. @throws InputError when there is none.
ActiveRun require_active_run(const std::filesystem::path& directory = {});

/// Lists the calling process as long as it lives. Programs that it starts do not inherit the lock.
class ActiveRunEntry {
 public:
  /// @throws InputError when the list cannot be written, as where its folder is another user's.
  ActiveRunEntry(const std::filesystem::path& directory, const std::string& url);
  ~ActiveRunEntry();
  ActiveRunEntry(const ActiveRunEntry&) = delete;
  ActiveRunEntry& operator=(const ActiveRunEntry&) = delete;

 private:
  std::filesystem::path file_;
  int lock_ = -1;
};

}  // namespace berth
