// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/notify.h"

#include "common/core/child_process.h"

namespace berth::nights {

std::string notify(const std::string& command, const NightReport& report,
                   const std::filesystem::path& out, const std::filesystem::path& program) {
  const std::vector<std::pair<std::string, std::string>> environment = {
      {"BERTH_NIGHT", report.night.name},
      {"BERTH_NIGHT_VERDICT", report.night.verdict},
      {"BERTH_NIGHT_EXIT_CODE", std::to_string(report.exit_code())},
      {"BERTH_NIGHT_DIRECTORY", (out / report.night.name).string()},
      {"BERTH_NIGHT_INDEX", (out / "index.html").string()},
      {"BERTH_NIGHT_VERSION", report.night.version},
      {"BERTH_NIGHT_BUILD", program.string()}};
  try {
    const ProcessEnd end = feed_program({"sh", "-c", command}, text_of(report), environment);
    return end.ok() ? "" : "notify: '" + command + "' " + end.text();
  } catch (const std::exception& e) {
    return std::string("notify: ") + e.what();
  }
}

}  // namespace berth::nights
