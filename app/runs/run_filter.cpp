// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <chrono>

#include "app/runs/run_list.h"
#include "common/core/error.h"
#include "common/core/quantity.h"
#include "common/core/utc.h"

namespace berth {
namespace {

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// The earliest time as it would be written; ISO times sort as text.
std::string earliest(const std::string& since) {
  const auto is_digit = [&](std::size_t i) {
    return std::isdigit(static_cast<unsigned char>(since[i])) != 0;
  };
  if (since.size() >= 10 && is_digit(0) && is_digit(3) && since[4] == '-' && since[7] == '-') {
    return since;
  }
  double ago = 0;
  const auto days = since.find(" day");
  try {
    ago = days != std::string::npos ? 86400 * std::stod(since.substr(0, days))
                                    : parse_quantity(since, Dimension::time);
  } catch (const std::exception&) {
    throw InputError("--since: found '" + since +
                     "', expected a date such as 2026-11-20, or a time such as '12 h' or '3 days'");
  }
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  return utc_text(now - static_cast<std::time_t>(ago));
}

}  // namespace

std::vector<RunEntry> matching(const std::vector<RunEntry>& runs, const RunFilter& filter,
                               std::size_t limit) {
  const std::string from = filter.since.empty() ? "" : earliest(filter.since);
  std::vector<RunEntry> found;
  for (const RunEntry& run : runs) {
    if (run.procedure.find(filter.procedure) == std::string::npos) continue;
    if (run.host.find(filter.host) == std::string::npos) continue;
    if (!filter.outcome.empty() && state_text(run) != upper(filter.outcome)) continue;
    if (run.created < from) continue;
    found.push_back(run);
  }
  if (limit != 0 && found.size() > limit) {
    found.erase(found.begin(), found.end() - static_cast<std::ptrdiff_t>(limit));
  }
  return found;
}

}  // namespace berth
