// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/checksums.h"

#include <map>
#include <sstream>

#include "app/directory_lock.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

/// Names of all files of a run that do not change any more, relative to it, in order.
std::vector<std::string> files_of(const fs::path& run) {
  std::map<std::string, bool> names;
  for (const auto& entry : fs::recursive_directory_iterator(run)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), run).generic_string();
    if (name == checksums_file || entry.path().filename() == DirectoryLock::file_name) continue;
    // The supervisor may still have a last word.
    if (name != "output/supervisor.txt") names[name] = true;
  }
  std::vector<std::string> sorted;
  for (const auto& [name, is_there] : names) sorted.push_back(name);
  return sorted;
}

}  // namespace

void write_checksums(const fs::path& run) {
  std::string text;
  std::string unread;
  for (const std::string& name : files_of(run)) {
    try {
      text += sha256_of_file(run / name) + "  " + name + "\n";
    } catch (const InputError& e) {
      unread = e.what();
    }
  }
  write_file(run / checksums_file, text);
  if (!unread.empty()) throw InputError(unread);
}

std::vector<std::string> verify_checksums(const fs::path& run) {
  if (!fs::exists(run / checksums_file)) {
    throw InputError(run.string() + ": has no SHA256SUMS: the run did not come to its end");
  }
  std::map<std::string, std::string> listed;
  std::istringstream lines(read_file(run / checksums_file));
  for (std::string line; std::getline(lines, line);) {
    if (line.size() > 66) listed[line.substr(66)] = line.substr(0, 64);
  }
  std::vector<std::string> problems;
  for (const auto& [name, hash] : listed) {
    if (!fs::exists(run / name)) {
      problems.push_back(name + " is missing");
    } else if (sha256_of_file(run / name) != hash) {
      problems.push_back(name + " was changed");
    }
  }
  for (const std::string& name : files_of(run)) {
    if (listed.count(name) == 0) problems.push_back(name + " is not listed");
  }
  return problems;
}

}  // namespace berth
