// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/watched_process.h"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>

#include "common/core/error.h"

namespace berth {
namespace {

/// An open file, for as long as a process is being started.
struct OutputFile {
  explicit OutputFile(const std::filesystem::path& path)
      : fd(open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
    if (fd < 0) throw InputError(path.string() + ": cannot be written");
  }
  ~OutputFile() { close(fd); }
  ChildOptions options() const {
    ChildOptions options;
    options.output = options.errors = fd;
    return options;
  }
  int fd;
};

}  // namespace

WatchedProcess::WatchedProcess(ProcessLoop& loop, const std::vector<std::string>& arguments,
                               const std::filesystem::path& output, Ended ended)
    : loop_(loop), child_(arguments, OutputFile(output).options()) {
  loop_.watch(child_.descriptor(), [this, ended = std::move(ended)] {
    const auto end = child_.wait_for(std::chrono::milliseconds(0));
    if (!end) return;
    loop_.unwatch(child_.descriptor());
    ended(*end);
  });
}

WatchedProcess::~WatchedProcess() {
  if (running()) loop_.unwatch(child_.descriptor());
}

std::string last_line(const std::filesystem::path& output) {
  std::ifstream in(output);
  std::string last;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

}  // namespace berth
