// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/watched_process.h"

#include <fstream>

namespace berth {
namespace {

ChildOptions output_into(const std::filesystem::path& file) {
  ChildOptions options;
  options.output_file = file;
  return options;
}

}  // namespace

WatchedProcess::WatchedProcess(ProcessLoop& loop, const std::vector<std::string>& arguments,
                               const std::filesystem::path& output, Ended ended)
    : loop_(loop), child_(arguments, output_into(output)) {
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
