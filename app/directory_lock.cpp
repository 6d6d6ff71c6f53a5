// SPDX-License-Identifier: BSD-3-Clause
#include "app/directory_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "app/host_name.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/utc.h"

namespace berth {

DirectoryLock::DirectoryLock(const std::filesystem::path& directory, Busy busy) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  const std::filesystem::path file = directory / file_name;
  fd_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0) throw InputError(directory.string() + ": cannot be written: " + strerror(errno));
  int locked = flock(fd_, LOCK_EX | (busy == Busy::refuse ? LOCK_NB : 0));
  while (locked != 0 && errno == EINTR) locked = flock(fd_, LOCK_EX);
  if (locked != 0) {
    close(fd_);
    std::string holder = read_file(file);
    while (!holder.empty() && holder.back() == '\n') holder.pop_back();
    throw InputError(directory.string() + ": another berth is at work there" +
                     (holder.empty() ? "" : ": " + holder) + "; wait until it has ended");
  }
  const std::string text = "process " + std::to_string(getpid()) + " on " + host_name() +
                           ", since " + utc_text(std::time(nullptr)) + "\n";
  // Only for people: the lock holds without it.
  [[maybe_unused]] const bool written =
      ftruncate(fd_, 0) == 0 && pwrite(fd_, text.data(), text.size(), 0) > 0;
}

DirectoryLock::~DirectoryLock() {
  [[maybe_unused]] const int ignored = ftruncate(fd_, 0);
  close(fd_);
}

}  // namespace berth
