// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "evaluation/compare/comparison.h"
#include "evaluation/report/chart.h"
#include "evaluation/report/run_details.h"

namespace berth::report {

/// A log with all that a report shows of it.
struct ReportedRun {
  std::filesystem::path log;
  std::filesystem::path directory;  ///< of the run; empty where only the log is at hand
  evaluation::ComparedRun run;
  RunDetails details;

  std::string name() const;  ///< of the run, or of its log's file
};

/// Reads and judges a log in one pass: each run in it, by their starts.
/// @param directory of the run; empty: a log alone
/// @throws InputError as compare_runs.
std::vector<ReportedRun> read_reported_runs(const std::filesystem::path& log,
                                            const std::filesystem::path& directory = {});

/// A run made ready for its charts: times count from the run's start.
class RunView {
 public:
  /// The run must outlive it.
  explicit RunView(const ReportedRun& run);

  const ReportedRun& source() const { return source_; }
  const evaluation::RunRecord& record() const { return source_.run.record; }
  const evaluation::Comparison& comparison() const { return source_.run.comparison; }
  const evaluation::Measurer& measurer() const { return measurer_; }
  const RunDetails& details() const { return source_.details; }

  Utime start() const { return start_; }
  double end_s() const { return end_s_; }
  double at(Utime utime) const { return seconds(utime - start_); }
  /// Phases in which the procedure did something, without the whole run and the teardown.
  const std::vector<evaluation::Phase>& phases() const { return phases_; }
  /// Name of the phase at that time; empty between phases.
  std::string phase_at(Utime utime) const;

  /// A chart over the whole run, with its phases, the times without a good estimate, and the events
  /// that are warnings or worse.
  Chart chart(const std::string& title, const std::string& unit) const;

 private:
  const ReportedRun& source_;
  evaluation::Measurer measurer_;
  Utime start_ = 0;
  double end_s_ = 1;
  std::vector<evaluation::Phase> phases_;
  std::vector<Span> spans_;
  std::vector<Mark> marks_;
};

using Views = std::vector<const RunView*>;

/// "OK", "AMBIGUOUS" ...
const char* text_of_status(std::int8_t status);

}  // namespace berth::report
