// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/excerpt.h"

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

  bool wants(const LogEvent& event) {
    auto found = channels_.find(event.channel);
    if (found == channels_.end()) {
      const Wanted wanted{include_.matches(event.channel) && !exclude_.matches(event.channel),
                          keep_.matches(event.channel)};
      found = channels_.emplace(event.channel, wanted).first;
    }
    if (!found->second.at_all) return false;
    if (found->second.always) return true;
    return (!excerpt_.from || event.utime >= *excerpt_.from) &&
           (!excerpt_.to || event.utime <= *excerpt_.to);
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

Utime first_time(const std::filesystem::path& log) {
  LogReader reader(log);
  LogEvent event;
  if (!reader.next(event)) throw InputError(log.string() + ": holds no message");
  return event.utime;
}

}  // namespace

ExcerptResult write_excerpt(const std::filesystem::path& in, const std::filesystem::path& out,
                            const Excerpt& excerpt) {
  Chooser chooser(excerpt);
  LogReader reader(in);
  DerivedLog log(out);
  ExcerptResult result;
  LogEvent event;
  while (reader.next(event)) {
    if (chooser.wants(event)) {
      log.writer().write(event.utime, std::string(event.channel), event.data);
      ++result.written;
    } else {
      ++result.left_out;
    }
  }
  result.damaged_bytes = reader.damaged_bytes();
  log.finish();
  return result;
}

Utime time_in_log(const std::filesystem::path& log, const std::string& text, bool end) {
  if (is_number(text) && text.size() > 12 && text.find('.') == std::string::npos) {
    return std::stoll(text);
  }
  LogSummary summary;
  if (!text.empty() && text.find_first_not_of("0123456789.-+") != 0) {
    const std::string quantity = is_number(text) ? text + " s" : text;
    return first_time(log) + utime_from_seconds(parse_quantity(quantity, berth::Dimension::time));
  }
  const RunRecord record = read_run(log, summary);
  if (const auto phase = record.phase(text)) return end ? phase->end() : phase->start();
  std::string known;
  for (const Phase& phase : record.phases()) known += (known.empty() ? "" : ", ") + phase.name;
  throw InputError("found '" + text +
                   "', expected seconds after the log's start, a utime, or a phase (" +
                   (known.empty() ? "this log has none" : known) + ")");
}

}  // namespace berth::logs
