// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "app/commands/commands.h"
#include "app/configuration/described_keys.h"
#include "app/exit_code.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/renamed_keys.h"
#include "common/core/yaml.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> files_named(const fs::path& path) {
  if (fs::is_regular_file(path)) return {path};
  if (fs::is_directory(path)) return yaml_files(path);
  throw InputError(path.string() + ": found neither a folder nor a file");
}

/// @return whether the file could be read
bool migrate(const fs::path& file, bool dry, int& count) {
  try {
    std::vector<Renamed> renamed;
    const std::string text = with_present_names(read_file(file), file.string(), &renamed);
    if (!renamed.empty() && !dry) write_file(file, text);
    for (const Renamed& r : renamed) {
      std::printf("%s:%d: %s -> %s\n", file.c_str(), r.line, r.before.c_str(), r.now.c_str());
    }
    count += static_cast<int>(renamed.size());
    return true;
  } catch (const InputError& e) {
    std::fprintf(stderr, "%s; left as it is\n", e.what());
    return false;
  }
}

struct DescribeOptions {
  std::string what;
  bool schema = false;
  bool json = false;
};

void list_kinds(bool json) {
  Table table{"lll", {"kind", "files", keyed("what they configure", "what")}};
  for (const ConfigKind& kind : config_kinds()) {
    table.rows.push_back({kind.name, kind.files, kind.what});
  }
  print_table(table, json);
}

/// what: a kind, or a file of one.
void describe(const DescribeOptions& options) {
  const bool is_file = fs::is_regular_file(options.what);
  const ConfigKind& kind = is_file ? kind_of_file(options.what) : config_kind(options.what);
  const auto keys = described_keys(kind, is_file ? fs::path(options.what) : fs::path());
  if (options.schema) {
    std::printf("%s", key_schema(kind, keys).c_str());
  } else {
    print_table(key_table(keys, is_file), options.json);
  }
}

}  // namespace

void add_config(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("config", "Configuration files of a site");
  command->require_subcommand(1);
  CLI::App* migrating = command->add_subcommand(
      "migrate", "Rewrite keys that have other names now; comments and values stay");
  struct Options {
    fs::path path;
    bool dry = false;
  };
  auto options = std::make_shared<Options>();
  migrating->add_option("path", options->path, "Folder (all *.yaml below it), or a file")
      ->required();
  migrating->add_flag("--dry-run", options->dry, "Say what would be renamed, change nothing");
  migrating->callback([options, &exit_code] {
    int count = 0;
    bool all_read = true;
    for (const fs::path& file : files_named(options->path)) {
      all_read = migrate(file, options->dry, count) && all_read;
    }
    std::printf("%d keys %s\n", count, options->dry ? "to be renamed" : "renamed");
    exit_code = all_read ? exit_code::passed : exit_code::error;
  });

  CLI::App* describing = command->add_subcommand(
      "describe",
      "The keys of a kind of file, or of a file: unit, default, what is allowed, meaning");
  auto describe_options = std::make_shared<DescribeOptions>();
  describing->add_option("what", describe_options->what,
                         "Kind, or file; left out: which kinds there are");
  describing->add_flag("--json", describe_options->json, "JSON instead of a table");
  describing->add_flag("--json-schema", describe_options->schema,
                       "Print a JSON Schema (draft 2020-12), by which editors complete and check");
  describing->callback([describe_options] {
    if (describe_options->what.empty()) {
      list_kinds(describe_options->json);
    } else {
      describe(*describe_options);
    }
  });
}

}  // namespace berth::commands
