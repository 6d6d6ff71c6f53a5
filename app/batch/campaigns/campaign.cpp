// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/campaign.h"

#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "app/directory_lock.h"
#include "app/host_name.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/shared_files.h"
#include "common/core/utc.h"
#include "common/core/valid_text.h"
#include "common/core/version.h"
#include "common/targets/target.h"
#include "procedures/language/procedure.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

constexpr char record_file[] = "campaign.json";
constexpr char manifest_file[] = "campaign.yaml";

/// What a result depends on. A campaign goes on only where all of it is as it was.
ordered_json identity_of(const Manifest& manifest) {
  const Places& places = manifest.places;
  std::string target;
  const auto add_target = [&target](const std::string& place) {
    if (place.empty()) return;
    const Target loaded = load_target(place, 0);
    target += loaded.hash + loaded.description_hash;
  };
  add_target(places.target);
  for (const CampaignTarget& one : manifest.targets) add_target(one.place);
  return {
      {"manifest", sha256(manifest.text)},
      {"procedure",
       places.procedure.empty() ? "" : sha256(procedures::load_procedure(places.procedure).text)},
      {"configuration", sha256_of_tree(places.config, "")},
      {"target", target},
      {"berth", version()}};
}

/// Copies a procedure with those that it calls, which are named relative to its folder.
void keep_procedure(const fs::path& procedure, const fs::path& into) {
  fs::create_directories(into);
  copy_writable(procedure, into / procedure.filename());
  Config as_run = Config::parse(procedures::load_procedure(procedure).text, procedure.string());
  if (!as_run.has("called")) return;
  for (const std::string& name : as_run.section("called").keys()) {
    const fs::path kept = (into / name).lexically_normal();
    if (fs::relative(kept, into).native().rfind("..", 0) == 0) {
      throw InputError(procedure.string() + ": calls '" + name +
                       "' outside its folder, which a campaign cannot keep a copy of");
    }
    fs::create_directories(kept.parent_path());
    copy_writable(procedure.parent_path() / name, kept);
  }
}

/// Copies a target. @return where it is then; empty where none is named.
std::string keep_target(const std::string& target, const fs::path& into) {
  return target.empty() ? "" : copy_target(load_target(target, 0), into).string();
}

/// A target that was kept, relative to the campaign's directory, and back.
std::string in_record(const std::string& kept, const fs::path& directory) {
  return kept.empty() ? "" : fs::path(kept).lexically_relative(fs::absolute(directory)).string();
}
std::string in_directory(const std::string& recorded, const fs::path& directory) {
  const bool there = !recorded.empty() && fs::exists(directory / recorded);
  return there ? (directory / recorded).string() : recorded;
}

/// Copies what the manifest names.
Places keep(const Places& places, const fs::path& directory) {
  Places kept;
  kept.config = directory / "config";
  fs::remove_all(kept.config);
  copy_writable(places.config, kept.config);
  if (!places.procedure.empty()) {
    keep_procedure(places.procedure, directory / "procedure");
    kept.procedure = directory / "procedure" / places.procedure.filename();
  }
  kept.target = keep_target(places.target, directory / "target");
  for (const auto& [name, target] : places.targets) {
    kept.targets[name] = keep_target(target, directory / "target");
  }
  return kept;
}

ordered_json units_of(const Manifest& manifest) {
  ordered_json units = ordered_json::object();
  for (const KeptMeasurement& kept : manifest.measurements) units[kept.name] = kept.unit;
  return units;
}

ordered_json read_record(const fs::path& directory) {
  const fs::path file = directory / record_file;
  try {
    return ordered_json::parse(read_file(file));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file.string() + ": " + e.what());
  }
}

void write_record(const fs::path& directory, const ordered_json& record) {
  write_file(directory / record_file, json_text(record, 2) + "\n");
}

/// A file name that sorts as its number does.
std::string file_stem(const Block& block) {
  char name[64];
  std::snprintf(name, sizeof name, "%010lld-%010lld", static_cast<long long>(block.begin),
                static_cast<long long>(block.end));
  return name;
}

/// Some seconds of work: what is lost when power fails, and seldom enough on the disk.
std::int64_t block_size(const Manifest& manifest) {
  if (manifest.block > 0) return manifest.block;
  return manifest.experiment == "procedure" ? 10 : 250;
}

void refuse_another(const ordered_json& was, const ordered_json& is, const fs::path& directory) {
  for (const auto& [what, value] : is.items()) {
    if (was.value(what, std::string()) == value.get<std::string>()) continue;
    throw InputError(directory.string() + ": is a campaign with another " + what + " (" +
                     was.value(what, std::string()) + ", here " + value.get<std::string>() +
                     "): results must not be mixed; choose another --out");
  }
}

}  // namespace

void Campaign::require_place(const fs::path& directory) {
  if (!fs::exists(directory) || fs::exists(directory / manifest_file)) return;
  for (const auto& entry : fs::directory_iterator(directory)) {
    if (entry.path().filename() == DirectoryLock::file_name) continue;
    throw InputError(directory.string() + ": is there, and is no campaign; choose another --out");
  }
}

Campaign Campaign::create(const Manifest& manifest, const fs::path& directory,
                          std::int64_t trials) {
  if (trials == 0) trials = manifest.trials;
  const ordered_json identity = identity_of(manifest);
  if (fs::exists(directory / record_file)) {
    ordered_json record = read_record(directory);
    refuse_another(record.value("identity", ordered_json::object()), identity, directory);
    if (record["trials"] != trials) {
      record["trials"] = trials;
      write_record(directory, record);
    }
    return open(directory);
  }
  require_place(directory);
  std::error_code error;
  fs::create_directories(directory / "blocks", error);
  if (error) throw InputError("campaign directory " + directory.string() + ": " + error.message());
  write_file(directory / manifest_file, manifest.text);
  const Places kept = keep(manifest.places, fs::absolute(directory));
  ordered_json targets = ordered_json::object();
  for (const auto& [name, target] : kept.targets) targets[name] = in_record(target, directory);
  write_record(directory,
               {{"schema", "berth-campaign-1"},
                {"name", manifest.name},
                {"created", utc_text(std::time(nullptr))},
                {"machine", host_name()},
                {"trials", trials},
                {"points", manifest.points()},
                {"seed", manifest.seed},
                {"block", block_size(manifest)},
                {"procedure", kept.procedure.lexically_relative(fs::absolute(directory)).string()},
                {"target", in_record(kept.target, directory)},
                {"targets", targets},
                {"units", units_of(manifest)},
                {"identity", identity},
                {"compiler", __VERSION__}});
  return open(directory);
}

Campaign Campaign::open(const fs::path& directory) {
  if (!fs::exists(directory / record_file)) {
    throw InputError(directory.string() + ": is no campaign's directory: it has no campaign.json");
  }
  Campaign campaign;
  campaign.directory_ = fs::canonical(directory);
  const fs::path& at = campaign.directory_;
  const ordered_json record = read_record(at);
  try {
    Places places;
    places.config = at / "config";
    const std::string procedure = record.at("procedure");
    if (!procedure.empty()) places.procedure = at / procedure;
    places.target = in_directory(record.at("target"), at);
    const ordered_json targets = record.value("targets", ordered_json::object());
    for (const auto& [name, target] : targets.items()) {
      places.targets[name] = in_directory(target, at);
    }
    campaign.manifest_ =
        parse_manifest(read_file(at / manifest_file), (at / manifest_file).string(), &places);
    campaign.build_ = record.at("identity").at("berth");
    campaign.created_ = record.at("created");
    campaign.manifest_.name = record.at("name");
    campaign.manifest_.trials = record.at("trials");
    campaign.manifest_.block = record.at("block");
  } catch (const nlohmann::json::exception& e) {
    throw InputError((at / record_file).string() + ": " + e.what());
  }
  return campaign;
}

void Campaign::require_this_build() const {
  if (build_ == version()) return;
  throw InputError(directory_.string() + ": was begun with Berth " + build_ + ", this is " +
                   version() + ": results must not be mixed");
}

BatchRecord Campaign::batch() const {
  BatchRecord batch;
  batch.name = manifest_.name;
  batch.begun = created_;
  batch.plan_hash = sha256(manifest_.text);
  batch.build = batch.version = build_;
  return batch;
}

std::vector<Block> Campaign::blocks() const {
  std::vector<Block> blocks;
  for (std::int64_t begin = 0; begin < manifest_.total(); begin += manifest_.block) {
    blocks.push_back({begin, std::min(begin + manifest_.block, manifest_.total())});
  }
  return blocks;
}

std::vector<Block> Campaign::missing_blocks() const {
  auto missing = blocks();
  std::erase_if(missing, [&](const Block& block) { return fs::exists(block_file(block)); });
  return missing;
}

fs::path Campaign::block_file(const Block& block) const {
  return directory_ / "blocks" / (file_stem(block) + ".jsonl");
}

fs::path Campaign::started_file(const Block& block) const {
  return directory_ / "blocks" / (file_stem(block) + ".started");
}

}  // namespace berth::campaigns
