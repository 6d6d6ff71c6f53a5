// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/choose_setup.h"

#include "app/runs/run_files.h"
#include "common/core/error.h"

namespace berth {
namespace fs = std::filesystem;

RunSetup choose_setup(const SetupChoice& choice, const procedures::Procedure* procedure) {
  RunSetup setup;
  setup.config = choice.config.empty() ? shared_files() / "config" : choice.config;
  if (!fs::is_directory(setup.config / "layouts")) {
    throw InputError("configuration " + setup.config.string() + ": has no layouts/");
  }
  std::string target = choice.target;
  setup.target_length = choice.target_length;
  if (procedure != nullptr) {
    if (!procedure->layout.empty()) setup.layout = procedure->layout;
    if (target.empty()) {
      target = procedure->target;
      if (setup.target_length == 0) setup.target_length = procedure->target_length;
    }
  }
  if (!choice.layout.empty()) setup.layout = choice.layout;
  if (!target.empty()) setup.target = target;
  if (!fs::exists(setup.layout_file())) {
    throw InputError("layout '" + setup.layout + "': no file " + setup.layout_file().string());
  }
  if (setup.target != "radarsat2") {
    if (!fs::exists(setup.target)) {
      throw InputError("target '" + setup.target + "': no such file, and not 'radarsat2'");
    }
    setup.target = fs::absolute(setup.target).string();
  }
  return setup;
}

}  // namespace berth
