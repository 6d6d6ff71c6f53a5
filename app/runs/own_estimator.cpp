// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/own_estimator.h"

#include <dlfcn.h>
#include <unistd.h>

#include "common/bus/lcm_bus.h"
#include "common/core/error.h"
#include "common/core/sha256.h"
#include "estimator/node/estimator_plugin.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

bool is_shared_library(const fs::path& file) {
  return file.filename().string().find(".so") != std::string::npos;
}

InputError wrong(const std::string& named, const std::string& what) {
  return InputError("--estimator " + named + ": " + what);
}

}  // namespace

std::string check_own_estimator(const std::string& named, const std::string& host) {
  const bool twin = host == "twin";
  if (named == outside_estimator) {
    if (!twin) return named;
    throw wrong(
        named,
        "the twin is one process with a clock of its own, which no outside program can follow; "
        "expected a shared library, or no --twin");
  }
  std::error_code error;
  const fs::path file = fs::canonical(named, error);
  if (error) {
    throw wrong(named, std::string("no such file; expected ") +
                           (twin ? "a shared library" : "a program, or 'outside'"));
  }
  if (twin) {
    load_own_estimator(file);
  } else if (is_shared_library(file)) {
    throw wrong(named, "found a shared library, which is for --twin; expected a program");
  } else if (!fs::is_regular_file(file) || access(file.c_str(), X_OK) != 0) {
    throw wrong(named, "expected a program: it is no file that may be executed");
  }
  return file.string();
}

EstimatorMaker load_own_estimator(const fs::path& library) {
  // Never closed: nodes, and what they threw, may live until the process ends.
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr)
    throw wrong(library, std::string("not a shared library to load: ") + dlerror());
  const auto function =
      reinterpret_cast<EstimatorPluginFunction*>(dlsym(handle, estimator_plugin_function));
  if (function == nullptr) {
    throw wrong(library, std::string("exports no function '") + estimator_plugin_function +
                             "': expected BERTH_ESTIMATOR_PLUGIN(...) of "
                             "estimator/node/estimator_plugin.h in one of its sources");
  }
  const EstimatorPlugin* const plugin = function();
  if (plugin == nullptr || plugin->version != estimator_plugin_version) {
    throw wrong(library, "is of interface version " +
                             (plugin == nullptr ? "none" : std::to_string(plugin->version)) +
                             ", expected " + std::to_string(estimator_plugin_version) +
                             ": build it against this Berth's headers");
  }
  return plugin->make;
}

OwnEstimatorRecord record_of_own_estimator(const std::string& named) {
  if (named.empty() || named == outside_estimator) return {named, ""};
  return {fs::path(named).filename().string(), sha256_of_file(named)};
}

std::string how_to_start_estimator(const RunFiles& files) {
  return "run by somebody else: start it with --run " + files.directory.string() + " --lcm-url '" +
         bus_url(files.url) + "'";
}

}  // namespace berth
