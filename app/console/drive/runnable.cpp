// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/drive/runnable.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "common/core/config.h"
#include "common/core/file.h"

namespace berth::console {
namespace fs = std::filesystem;
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Parameters stand one to a line, with their values: "  speed: 20 mm/s   # of the approach".
std::vector<Runnable::Parameter> parameters_of(const std::string& text) {
  std::vector<Runnable::Parameter> parameters;
  std::istringstream in(text);
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("parameters:", 0) == 0) {
      inside = true;
    } else if (inside && !line.empty() && line[0] != ' ' && line[0] != '#') {
      break;
    } else if (inside) {
      const auto comment = std::min(line.find(" #"), line.size());
      const std::string setting = trimmed(line.substr(0, comment));
      const auto colon = setting.find(':');
      if (colon == std::string::npos || setting[0] == '#') continue;
      parameters.push_back({setting.substr(0, colon), trimmed(setting.substr(colon + 1)),
                            comment < line.size() ? trimmed(line.substr(comment + 2)) : ""});
    }
  }
  return parameters;
}

std::optional<Runnable> read(const fs::path& directory, const fs::path& file) {
  try {
    Config config = Config::load(file);
    if (!config.has("steps")) return std::nullopt;
    Runnable runnable;
    runnable.file = fs::relative(file, directory).generic_string();
    runnable.title = config.text("name");
    config.optional("description", runnable.description);
    runnable.parameters = parameters_of(read_file(file));
    return runnable;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

std::vector<Runnable> runnables(const fs::path& directory) {
  std::vector<Runnable> found;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.path().extension() != ".yaml") continue;
    if (auto runnable = read(directory, entry.path())) found.push_back(std::move(*runnable));
  }
  const auto depth = [](const Runnable& r) {
    return std::count(r.file.begin(), r.file.end(), '/');
  };
  std::sort(found.begin(), found.end(), [&depth](const Runnable& a, const Runnable& b) {
    return std::make_pair(depth(a), a.file) < std::make_pair(depth(b), b.file);
  });
  return found;
}

std::string to_json(const std::vector<Runnable>& runnables) {
  nlohmann::json json = nlohmann::json::array();
  for (const Runnable& runnable : runnables) {
    nlohmann::json parameters = nlohmann::json::array();
    for (const auto& p : runnable.parameters) {
      parameters.push_back(
          {{"name", p.name}, {"value", p.value}, {"unit", ""}, {"description", p.description}});
    }
    json.push_back({{"file", runnable.file},
                    {"title", runnable.title},
                    {"description", runnable.description},
                    {"parameters", std::move(parameters)}});
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace berth::console
