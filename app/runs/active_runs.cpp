// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/active_runs.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "common/core/error.h"
#include "common/core/file.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

fs::path registry() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  return runtime != nullptr && *runtime != '\0'
             ? fs::path(runtime) / "berth"
             : temporary_directory() / ("berth-" + std::to_string(getuid()));
}

pid_t process_of(const fs::path& entry) {
  const std::string name = entry.filename().string();
  pid_t pid = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
  return error == std::errc() && end == name.data() + name.size() ? pid : 0;
}

/// Whether a process holds the entry. An entry without a holder is removed.
bool is_held(const fs::path& entry) {
  const int fd = open(entry.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) return false;
  const bool held = flock(fd, LOCK_SH | LOCK_NB) != 0;
  struct stat opened {};
  struct stat there {};
  const bool same =
      fstat(fd, &opened) == 0 && stat(entry.c_str(), &there) == 0 && opened.st_ino == there.st_ino;
  if (!held && same) unlink(entry.c_str());
  close(fd);
  return held;
}

}  // namespace

std::vector<ActiveRun> active_runs() {
  std::vector<std::pair<fs::file_time_type, ActiveRun>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(registry(), error)) {
    const pid_t process = process_of(entry.path());
    if (process <= 0 || !is_held(entry.path())) continue;
    std::error_code gone;
    const auto written = entry.last_write_time(gone);
    std::ifstream in(entry.path());
    std::string directory;
    ActiveRun run;
    if (gone || !std::getline(in, directory) || !std::getline(in, run.url)) continue;  // just ended
    run.supervisor = process;
    run.directory = directory;
    found.emplace_back(written, run);
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<ActiveRun> runs;
  for (const auto& [when, run] : found) runs.push_back(run);
  return runs;
}

bool is_active(const ActiveRun& run) {
  const auto runs = active_runs();
  return std::any_of(runs.begin(), runs.end(), [&](const ActiveRun& other) {
    return other.supervisor == run.supervisor && other.directory == run.directory;
  });
}

std::optional<ActiveRun> find_active_run(const fs::path& directory) {
  std::optional<ActiveRun> newest;
  fs::path requested = directory.empty() ? directory : fs::absolute(directory).lexically_normal();
  if (!requested.has_filename())
    requested = requested.parent_path();  // "runs/x/", as shells complete it
  for (const auto& run : active_runs()) {
    if (requested.empty() || requested == run.directory) newest = run;
  }
  return newest;
}

ActiveRun require_active_run(const fs::path& directory) {
  const auto run = find_active_run(directory);
  if (run) return *run;
  throw InputError(directory.empty() ? "nothing is running"
                                     : directory.string() + ": is not running");
}

ActiveRunEntry::ActiveRunEntry(const fs::path& directory, const std::string& url) {
  const fs::path list = registry();
  const auto refuse = [&](const std::string& what) {
    return InputError(list.string() + ": " + what +
                      "; the list of running berths is kept there: set XDG_RUNTIME_DIR to a folder "
                      "of your own");
  };
  std::error_code error;
  fs::create_directories(list, error);
  struct stat status {};
  if (stat(list.c_str(), &status) != 0) throw refuse(std::strerror(errno));
  if (status.st_uid != getuid()) throw refuse("belongs to another user");
  // Locked before it appears under its name, so that it is never taken for one that was left
  // behind.
  file_ = list / std::to_string(getpid());
  const fs::path unseen = list / ("." + std::to_string(getpid()));
  lock_ = open(unseen.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const std::string text = directory.lexically_normal().string() + "\n" + url + "\n";
  if (lock_ < 0 || flock(lock_, LOCK_EX | LOCK_NB) != 0 ||
      write(lock_, text.data(), text.size()) != static_cast<ssize_t>(text.size()) ||
      rename(unseen.c_str(), file_.c_str()) != 0) {
    const std::string why = std::strerror(errno);
    if (lock_ >= 0) close(lock_);
    throw refuse("cannot be written: " + why);
  }
}

ActiveRunEntry::~ActiveRunEntry() {
  std::error_code ignored;
  fs::remove(file_, ignored);
  close(lock_);
}

}  // namespace berth
