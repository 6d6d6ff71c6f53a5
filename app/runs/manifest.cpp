// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/manifest.h"

#include <dlfcn.h>
#include <lcm/lcm.h>
#include <pwd.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "app/directory_lock.h"
#include "app/runs/own_estimator.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/utc.h"
#include "common/core/valid_text.h"
#include "common/core/version.h"
#include "logs/types/type_catalogue.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

/// "liblcm.so.1.3.1": the library has no function that returns its version.
std::string lcm_library() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&lcm_create), &info) == 0) return "";
  std::error_code error;
  const fs::path file = fs::canonical(info.dli_fname, error);
  return error ? info.dli_fname : file.filename().string();
}

ordered_json machine() {
  utsname system{};
  uname(&system);
  return {{"name", system.nodename},
          {"system", std::string(system.sysname) + " " + system.release},
          {"architecture", system.machine},
          {"processors", std::thread::hardware_concurrency()}};
}

ordered_json hashes_of(const fs::path& run) {
  ordered_json hashes = ordered_json::object();
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(run)) {
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), run));
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) hashes[file.generic_string()] = sha256_of_file(run / file);
  return hashes;
}

/// Copies the .lcm files into the log's directory; their fingerprints by name.
ordered_json keep_message_types(const fs::path& run) {
  ordered_json fingerprints = ordered_json::object();
  const fs::path definitions = shared_files() / "lcmtypes";
  if (!fs::is_directory(definitions)) return fingerprints;
  fs::create_directory(run / "types");
  for (const auto& entry : fs::directory_iterator(definitions)) {
    if (entry.path().extension() != ".lcm") continue;
    fs::copy_file(entry.path(), run / "types" / entry.path().filename());
  }
  logs::TypeCatalogue catalogue;
  catalogue.add(run / "types");
  for (const auto& type : catalogue.types()) {
    char text[20];
    std::snprintf(text, sizeof text, "0x%016llx",
                  static_cast<unsigned long long>(type->fingerprint));
    fingerprints[type->name] = text;
  }
  return fingerprints;
}

}  // namespace

std::string default_operator() {
  if (const char* name = std::getenv("BERTH_OPERATOR")) return name;
  const passwd* user = getpwuid(getuid());
  return user != nullptr ? user->pw_name : std::to_string(getuid());
}

void write_manifest(const RunFiles& files, const RunRequest& request) {
  const ordered_json types = keep_message_types(files.directory);
  const std::string operator_name =
      request.operator_name.empty() ? default_operator() : request.operator_name;
  const std::string target = files.setup.target;
  ordered_json manifest = {
      {"schema", "berth-run-1"},
      {"name", files.name},
      {"created", utc_text(std::time(nullptr))},
      {"operator", operator_name},
      {"host", files.host},
      {"machine", machine()},
      {"versions", {{"berth", version()}, {"lcm", lcm_library()}, {"compiler", __VERSION__}}},
      {"seed", files.setup.seed},
      {"session", files.setup.session},
      {"procedure", request.procedure.string()},
      {"parameters", files.parameters},
      {"layout", files.setup.layout},
      {"target", fs::path(target).filename().string()},
      {"configuration_hash", files.configuration_hash},
      {"message_types", types},
      {"files", hashes_of(files.directory)},
  };
  if (const auto own = record_of_own_estimator(files.estimator); !own.name.empty()) {
    manifest["estimator"] = {{"program", files.estimator}, {"sha256", own.sha256}};
  }
  write_file(files.directory / manifest_file, json_text(manifest, 2) + "\n");
}

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
