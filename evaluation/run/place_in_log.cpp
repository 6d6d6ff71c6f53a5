// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/place_in_log.h"

#include <charconv>

#include "common/core/error.h"
#include "common/core/quantity.h"
#include "evaluation/run/run_record.h"

namespace berth::evaluation {
namespace {

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789.-+") == std::string::npos;
}

}  // namespace

Utime place_in_log(const std::filesystem::path& log, const logs::Timeline& timeline,
                   const std::string& text, bool end) {
  const auto place_of = [&](Utime received) {
    return end ? timeline.last_position_of(received) : timeline.first_position_of(received);
  };
  if (is_number(text) && text.size() > 12 && text.find('.') == std::string::npos) {
    Utime received = 0;
    const auto end_of_text = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data(), end_of_text, received);
    if (error == std::errc() && at == end_of_text) return place_of(received);
    throw InputError("found '" + text + "', expected a utime: whole us since 1970");
  }
  LogSummary summary;
  if (!text.empty() && text.find_first_not_of("0123456789.-+") != 0) {
    const std::string quantity = is_number(text) ? text + " s" : text;
    return utime_from_seconds(parse_quantity(quantity, berth::Dimension::time));
  }
  const RunRecord record = read_run(log, summary);
  if (const auto phase = record.phase(text)) return place_of(end ? phase->end() : phase->start());
  std::string known;
  for (const Phase& phase : record.phases()) known += (known.empty() ? "" : ", ") + phase.name;
  throw InputError("found '" + text +
                   "', expected seconds after the log's start, a utime, or a phase (" +
                   (known.empty() ? "this log has none" : known) + ")");
}

}  // namespace berth::evaluation
