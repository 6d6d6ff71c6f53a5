// SPDX-License-Identifier: BSD-3-Clause
#include "app/commands/campaign_view.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "app/batch/campaigns/results.h"
#include "common/core/statistics.h"
#include "common/core/text.h"
#include "common/core/utc.h"
#include "common/core/valid_text.h"

namespace berth::commands {
namespace {

using namespace campaigns;

constexpr std::size_t max_broken_listed = 10;
constexpr std::int64_t max_points_shown = 60;

void print_points(const Campaign& campaign, const std::vector<TrialResult>& results) {
  const Manifest& manifest = campaign.manifest();
  const auto points = static_cast<std::size_t>(manifest.points());
  std::vector<std::vector<const TrialResult*>> of_point(points);
  for (const TrialResult& result : results) {
    of_point[static_cast<std::size_t>(result.point)].push_back(&result);
  }
  std::vector<std::vector<std::string>> lines(1);
  for (const Parameter& axis : manifest.grid) lines[0].push_back(axis.name);
  lines[0].insert(lines[0].end(), {"trials", "passed"});
  for (const KeptMeasurement& kept : manifest.measurements) {
    lines[0].push_back(kept.name + (kept.unit.empty() ? "" : ", " + kept.unit));
  }
  for (const auto& of : of_point) {
    if (of.empty()) continue;
    auto& line = lines.emplace_back();
    const auto passed = std::count_if(of.begin(), of.end(), [](auto* r) { return r->passed(); });
    for (std::size_t axis = 0; axis < manifest.grid.size(); ++axis) {
      line.push_back(of.front()->parameters[axis].second);
    }
    line.push_back(std::to_string(of.size()));
    line.push_back(fixed(100.0 * static_cast<double>(passed) / static_cast<double>(of.size()), 2) +
                   " %");
    for (const KeptMeasurement& kept : manifest.measurements) {
      std::vector<double> values;
      for (const TrialResult* r : of) values.push_back(r->measurement(kept.name));
      line.push_back(shown(median(finite(std::move(values)))));
    }
  }
  std::printf("%s  (medians of the trials)\n\n", text_table(lines, manifest.grid.size()).c_str());
}

}  // namespace

CampaignProgress::CampaignProgress() : is_terminal_(isatty(STDOUT_FILENO) == 1) {}

void CampaignProgress::tell(const RunnerProgress& progress) {
  const auto now = Clock::now();
  const auto pause = is_terminal_ ? std::chrono::milliseconds(250) : std::chrono::seconds(15);
  if (now - told_ < pause) return;
  told_ = now;
  const double elapsed = std::chrono::duration<double>(now - begun_).count();
  std::string text = std::to_string(progress.done) + " of " + std::to_string(progress.total) +
                     " trials (" + std::to_string(progress.workers) + " workers)";
  if (progress.done_now > 0 && elapsed > 1) {
    const double rate = static_cast<double>(progress.done_now) / elapsed;
    text += ", " + shown(rate) + " a second, " +
            clock_text(static_cast<double>(progress.total - progress.done) / rate) + " left";
  }
  std::printf(is_terminal_ ? "\r%s\033[K" : "%s\n", text.c_str());
  std::fflush(stdout);
}

void CampaignProgress::end() {
  if (is_terminal_) std::printf("\r\033[K");
}

void print_summary(const Campaign& campaign, const Summary& summary) {
  if (summary.present > 0 && campaign.manifest().points() <= max_points_shown) {
    print_points(campaign, read_results(campaign.trials_file()));
  }
  std::printf("%lld of %lld trials", static_cast<long long>(summary.present),
              static_cast<long long>(summary.trials));
  for (const auto& [outcome, count] : summary.outcomes) {
    std::printf(", %lld %s", static_cast<long long>(count), campaigns::name_of(outcome));
  }
  std::printf("\n");
  for (const auto& [failure, count] : summary.failures) {
    std::printf("  %6lld  %s\n", static_cast<long long>(count), terminal_line(failure).c_str());
  }
  if (!summary.broken.empty()) {
    std::printf("crashed or in error: trial");
    for (std::size_t i = 0; i < std::min(max_broken_listed, summary.broken.size()); ++i) {
      std::printf(" %lld", static_cast<long long>(summary.broken[i]));
    }
    std::printf("%s\n",
                summary.broken.size() > max_broken_listed ? " ... (all in summary.json)" : "");
  }
  if (!summary.missing.empty()) {
    std::printf("missing: %zu blocks, from trial %lld on; the same command goes on\n",
                summary.missing.size(), static_cast<long long>(summary.missing.front().begin));
  }
  std::printf("campaign %s\n", campaign.directory().c_str());
}

}  // namespace berth::commands
