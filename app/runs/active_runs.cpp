// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/active_runs.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "common/core/error.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

fs::path registry() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const fs::path directory =
      runtime != nullptr && *runtime != '\0'
          ? fs::path(runtime) / "berth"
          : fs::temp_directory_path() / ("berth-" + std::to_string(getuid()));
  fs::create_directories(directory);
  return directory;
}

}  // namespace

bool is_alive(pid_t pid) {
  if (pid <= 0 || kill(pid, 0) != 0) return false;
  std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(in, line);
  const auto name_end = line.rfind(") ");
  return name_end == std::string::npos || line.compare(name_end + 2, 1, "Z") != 0;
}

std::vector<ActiveRun> active_runs() {
  std::vector<std::pair<fs::file_time_type, ActiveRun>> found;
  for (const auto& entry : fs::directory_iterator(registry())) {
    ActiveRun run;
    run.supervisor = static_cast<pid_t>(std::atoi(entry.path().filename().c_str()));
    std::ifstream in(entry.path());
    std::string directory;
    std::getline(in, directory);
    std::getline(in, run.url);
    run.directory = directory;
    if (!is_alive(run.supervisor)) {
      fs::remove(entry.path());
      continue;
    }
    found.emplace_back(entry.last_write_time(), run);
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<ActiveRun> runs;
  for (const auto& [when, run] : found) runs.push_back(run);
  return runs;
}

std::optional<ActiveRun> find_active_run(const fs::path& directory) {
  std::optional<ActiveRun> newest;
  fs::path wanted = directory.empty() ? directory : fs::absolute(directory).lexically_normal();
  if (!wanted.has_filename()) wanted = wanted.parent_path();  // "runs/x/", as shells complete it
  for (const auto& run : active_runs()) {
    if (wanted.empty() || wanted == run.directory) newest = run;
  }
  return newest;
}

ActiveRun require_active_run(const fs::path& directory) {
  const auto run = find_active_run(directory);
  if (run) return *run;
  throw InputError(directory.empty() ? "nothing is running"
                                     : directory.string() + ": is not running");
}

ActiveRunEntry::ActiveRunEntry(const fs::path& directory, const std::string& url)
    : file_(registry() / std::to_string(getpid())) {
  std::ofstream(file_) << directory.lexically_normal().string() << "\n" << url << "\n";
}

ActiveRunEntry::~ActiveRunEntry() {
  std::error_code ignored;
  fs::remove(file_, ignored);
}

}  // namespace berth
