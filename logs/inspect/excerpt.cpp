// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/excerpt.h"

#include <unordered_map>

#include "logs/file/log_reader.h"
#include "logs/file/log_writer.h"
#include "logs/inspect/channel_pattern.h"

namespace berth::logs {
namespace {

struct Selection {
  bool at_all = true;
  bool always = false;
};

/// Whether the expressions match a channel, evaluated once for each.
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
      const Selection selection{include_.matches(event.channel) && !exclude_.matches(event.channel),
                                keep_.matches(event.channel)};
      found = channels_.emplace(event.channel, selection).first;
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
  std::unordered_map<std::string_view, Selection> channels_;  ///< names are views into the file
};

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

}  // namespace berth::logs
