// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/excerpt.h"

#include <charconv>
#include <unordered_map>

#include "common/core/error.h"
#include "common/core/quantity.h"
#include "logs/file/derived_log.h"
#include "logs/file/log_reader.h"
#include "logs/inspect/channel_pattern.h"
#include "logs/run/run_record.h"

namespace berth::logs {
namespace {

struct Wanted {
  bool at_all = true;
  bool always = false;
};

/// What the expressions say of a channel, asked once for each.
class Chooser {
 public:
  explicit Chooser(const Excerpt& excerpt)
      : excerpt_(excerpt),
        include_(excerpt.include, true),
        exclude_(excerpt.exclude, false),
        keep_(excerpt.keep, false) {}

  bool wants(const LogEvent& event, Utime position) {
    auto found = channels_.find(event.channel);
    if (found == channels_.end()) {
      const Wanted wanted{include_.matches(event.channel) && !exclude_.matches(event.channel),
                          keep_.matches(event.channel)};
      found = channels_.emplace(event.channel, wanted).first;
    }
    if (!found->second.at_all) return false;
    if (found->second.always) return true;
    return (!excerpt_.from || position >= *excerpt_.from) &&
           (!excerpt_.to || position <= *excerpt_.to);
  }

 private:
  const Excerpt& excerpt_;
  ChannelPattern include_;
  ChannelPattern exclude_;
  ChannelPattern keep_;
  std::unordered_map<std::string_view, Wanted> channels_;  ///< names are views into the file
};

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789.-+") == std::string::npos;
}

}  // namespace

ExcerptResult write_excerpt(const std::filesystem::path& in, const std::filesystem::path& out,
                            const Excerpt& excerpt) {
  Chooser chooser(excerpt);
  LogReader reader(in);
  const Timeline timeline(reader);
  Timeline::Walker positions(timeline);
  DerivedLog log(out);
  ExcerptResult result;
  LogEvent event;
  while (reader.next(event)) {
    if (chooser.wants(event, positions.position(event.utime))) {
      log.writer().write(event.utime, std::string(event.channel), event.data);
      ++result.written;
    } else {
      ++result.left_out;
    }
  }
  result.damaged_bytes = reader.damaged_bytes();
  result.steps = timeline.steps();
  log.finish();
  return result;
}

Utime place_in_log(const std::filesystem::path& log, const Timeline& timeline,
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

}  // namespace berth::logs
