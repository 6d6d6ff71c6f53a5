// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/run_starter.h"

#include <algorithm>
#include <fstream>

#include "app/console/control/runnable.h"

namespace berth::console {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t max_words = 600;

/// The end of its output, whole lines.
std::string last_words(const fs::path& file) {
  std::ifstream in(file);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  while (!text.empty() && text.back() == '\n') text.pop_back();
  if (text.size() <= max_words) return text;
  return text.substr(std::min(text.find('\n', text.size() - max_words), text.size() - 1) + 1);
}

}  // namespace

std::string RunStarter::start(const RunOrder& order) {
  if (child_ && child_->running()) return "another one is being checked";
  if (cell_.has_procedure) return "this run has a procedure of its own: berth up takes others";
  const fs::path procedures = shared_files() / "procedures";
  const auto known = runnables(procedures);
  const bool offered = std::any_of(known.begin(), known.end(), [&order](const Runnable& runnable) {
    return runnable.file == order.procedure;
  });
  if (!offered) return "there is no procedure '" + order.procedure + "'";
  std::vector<std::string> words{(program_directory() / "berth").string(),
                                 "run",
                                 "--detach",
                                 "--lcm-url",
                                 cell_.url,
                                 "--out",
                                 cell_.directory.parent_path().string(),
                                 "--operator",
                                 order.operator_name};
  for (const auto& [name, value] : order.parameters) {
    words.push_back("--set=" + name + "=" + value);
  }
  words.push_back((procedures / order.procedure).string());
  std::error_code ignored;
  fs::remove(output(), ignored);
  try {
    child_ = std::make_unique<WatchedProcess>(
        loop_, words, output(),
        [this](const ProcessEnd& end) { ended_(end.code(), last_words(output())); });
  } catch (const std::exception& e) {
    return e.what();
  }
  return {};
}

}  // namespace berth::console
