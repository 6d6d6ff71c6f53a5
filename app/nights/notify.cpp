// SPDX-License-Identifier: BSD-3-Clause
#include "app/nights/notify.h"

#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <cstdio>

namespace berth::nights {

std::string notify(const std::string& command, const NightReport& report,
                   const std::filesystem::path& out, const std::filesystem::path& program) {
  const auto set = [](const char* name, const std::string& value) {
    setenv(name, value.c_str(), 1);
  };
  set("BERTH_NIGHT", report.night.name);
  set("BERTH_NIGHT_VERDICT", report.night.verdict);
  set("BERTH_NIGHT_EXIT_CODE", std::to_string(report.exit_code()));
  set("BERTH_NIGHT_DIRECTORY", (out / report.night.name).string());
  set("BERTH_NIGHT_INDEX", (out / "index.html").string());
  set("BERTH_NIGHT_VERSION", report.night.version);
  set("BERTH_NIGHT_BUILD", program.string());

  // A command that does not read its input must not end us.
  const auto before = signal(SIGPIPE, SIG_IGN);
  std::fflush(nullptr);
  std::FILE* pipe = popen(command.c_str(), "w");
  if (pipe == nullptr) return "notify: cannot start a shell";
  const std::string text = text_of(report);
  std::fwrite(text.data(), 1, text.size(), pipe);
  const int status = pclose(pipe);
  signal(SIGPIPE, before);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  return "notify: '" + command + "' ended with " +
         (WIFEXITED(status) ? "exit code " + std::to_string(WEXITSTATUS(status))
                            : "signal " + std::to_string(WTERMSIG(status)));
}

}  // namespace berth::nights
