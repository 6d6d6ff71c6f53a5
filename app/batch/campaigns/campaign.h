// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/batch/campaigns/trial.h"
#include "app/batch/result_store.h"

namespace berth::campaigns {

/// Trials [begin, end): what a worker does at a time, and what is lost at most.
struct Block {
  std::int64_t begin = 0;
  std::int64_t end = 0;
  std::int64_t size() const { return end - begin; }
};

/// A campaign's directory: everything that makes and records it, with copies of what it names.
///
///     campaign.yaml     the manifest as given
///     campaign.json     trials requested, versions, hashes, seed, units, machine
///     procedure/, config/, target/    what the trials use
///     blocks/           results of finished blocks, and of those under way (.started)
/// and after the merge:
///     results.sqlite    all results, in order: what the report and the summary are made of
///     trials.jsonl      the same for other programs, one line each
///     summary.json      counts, failures, what is missing
///     report.html, report.json, SHA256SUMS
class Campaign {
 public:
  static constexpr char results_name[] = "results.sqlite";

  /// @throws InputError when the directory is there and holds something else.
  static void require_place(const std::filesystem::path& directory);
  /// Makes the directory, or opens the one that is there when it is of the same campaign.
  /// @param trials at each point instead of the manifest's; 0: the manifest's. More than before
  /// goes on where it was: trial i does not depend on how many there are.
  /// @throws InputError when it cannot be written, or is of another manifest, build or
  /// configuration.
  static Campaign create(const Manifest& manifest, const std::filesystem::path& directory,
                         std::int64_t trials);
  /// Opens one. @throws InputError when it is none.
  static Campaign open(const std::filesystem::path& directory);

  const std::filesystem::path& directory() const { return directory_; }
  /// @throws InputError when it was begun with another build: its results are not ours to add to.
  void require_this_build() const;
  /// As run: with the trials requested, and with places inside the directory.
  const Manifest& manifest() const { return manifest_; }

  /// What the results say of it as a whole.
  BatchRecord batch() const;

  /// All blocks, in order. The same for any number of workers and any engine.
  std::vector<Block> blocks() const;
  /// Those that have no result yet.
  std::vector<Block> missing_blocks() const;

  std::filesystem::path block_file(const Block& block) const;
  std::filesystem::path started_file(const Block& block) const;
  std::filesystem::path results_file() const { return directory_ / results_name; }
  std::filesystem::path trials_file() const { return directory_ / "trials.jsonl"; }
  std::filesystem::path report_file() const { return directory_ / "report.html"; }

 private:
  std::filesystem::path directory_;
  Manifest manifest_;
  std::string build_;    ///< version() of the one that made it
  std::string created_;  ///< UTC
};

}  // namespace berth::campaigns
