// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "app/batch/campaigns/campaign.h"

namespace berth::campaigns {

/// One JSON object on one line, without its end. The same result gives the same bytes.
///
///     {"trial":7,"point":1,"seed":123,"parameters":{"returns":"100"},"attitude_wxyz":[1,0,0,0],
///      "outcome":"PASS","failure":"","measurements":{"position_error":2.5},"error":""}
std::string line_of(const TrialResult& result);

/// @param where "file:line", for messages. @throws InputError when it is no such line.
TrialResult result_of_line(const std::string& line, const std::string& where);

/// Writes the results of one block: into its .started file, a whole line for each trial as it
/// comes, and at the end, whole or not at all, into its own. What an earlier worker left is taken
/// over.
class BlockWriter {
 public:
  /// Locks the block: a cluster's tasks share the directory, each with blocks of its own.
  /// @throws InputError when it cannot be written, or another process is at work on it
  BlockWriter(const Campaign& campaign, const Block& block);
  ~BlockWriter();
  BlockWriter(const BlockWriter&) = delete;
  BlockWriter& operator=(const BlockWriter&) = delete;

  /// The first trial without a result; the block's end when all have one.
  std::int64_t next() const { return next_; }
  /// Of the trial next(). @throws InputError when it cannot be written
  void add(const TrialResult& result);
  /// All trials have their result. @throws InputError when it cannot be written
  void finish();

 private:
  void write(const std::string& text);

  std::filesystem::path block_file_;
  std::filesystem::path started_file_;
  int file_;
  std::int64_t next_;
  std::string lines_;
};

/// What came of the blocks that are there.
struct Summary {
  std::int64_t trials = 0;   ///< requested
  std::int64_t present = 0;  ///< with a result
  std::map<Outcome, std::int64_t> outcomes;
  std::map<std::string, std::int64_t> failures;  ///< by kind
  std::vector<Block> missing;
  std::vector<std::int64_t> broken;  ///< trials that ended in an error or a crash

  bool complete() const { return present == trials; }
};

/// Joins the results of finished blocks into results.sqlite and, for other programs, trials.jsonl;
/// writes summary.json. Takes whatever is there; may be repeated. @throws InputError.
Summary merge(const Campaign& campaign);

/// What the processes took.
struct RunnerCost {
  std::int64_t trials = 0;
  double wall_s = 0;
  double user_s = 0;  ///< of the workers, what they share included
  double system_s = 0;
};

/// Adds a line to the campaign's cost.jsonl: what one process and its workers took. Apart from the
/// results, which no clock touches.
///
///     {"machine":"a","jobs":2,"trials":500,"wall_s":3.1,"user_s":5.9,"system_s":0.1}
void note_cost(const Campaign& campaign, const RunnerCost& cost, int jobs);

/// The sum of those lines; truncated lines are skipped.
struct CampaignCost {
  double trials = 0;
  double processor_s = 0;
  double fastest = 0;  ///< trials per s of wall time, of the fastest process
  int jobs = 0;        ///< its workers
};
CampaignCost campaign_cost(const std::filesystem::path& directory);

/// "500 trials in 3.1 s: 161.3 a second; 11.8 ms of processor time a trial"
std::string text_of(const RunnerCost& cost);

}  // namespace berth::campaigns
