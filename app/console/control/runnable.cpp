// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/control/runnable.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/core/config.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"
#include "common/core/yaml.h"
#include "common/core/yaml_text.h"
#include "procedures/language/parameters.h"

namespace berth::console {
namespace fs = std::filesystem;
namespace {

std::optional<Runnable> read(const fs::path& directory, const fs::path& file) {
  try {
    const procedures::Written written = procedures::read_written(read_file(file), file.string());
    if (!written.tree.has("steps")) return std::nullopt;  // a plan of nights, or the like
    Config config(written.tree, file.string());
    Runnable runnable;
    runnable.file = fs::relative(file, directory).generic_string();
    runnable.title = config.text("name");
    config.optional("description", runnable.description);
    for (const procedures::Parameter& parameter : written.parameters) {
      runnable.parameters.push_back(
          {parameter.name.text(), plain_text(parameter.value), parameter.comment});
    }
    return runnable;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

std::vector<Runnable> runnables(const fs::path& directory) {
  std::vector<Runnable> found;
  for (const fs::path& file : yaml_files(directory)) {
    if (auto runnable = read(directory, file)) found.push_back(std::move(*runnable));
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
  return json_text(json);
}

}  // namespace berth::console
