// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace berth {

/// One command at a time in one directory, which is made where there is none. The proof is a lock
/// (flock) on its file `.lock`, which the kernel drops when the process ends, however it ends; the
/// file names the holder.
class DirectoryLock {
 public:
  static constexpr char file_name[] = ".lock";

  enum class Busy { refuse, wait };
  /// @param busy what to do while another one holds it
  /// @throws InputError when it cannot be written, or another one is at work there: which process,
  /// on which machine, since when.
  explicit DirectoryLock(const std::filesystem::path& directory, Busy busy = Busy::refuse);
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace berth
