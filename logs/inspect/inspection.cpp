// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/inspection.h"

#include <algorithm>
#include <unordered_map>

#include "common/core/text.h"

namespace berth::logs {
namespace {

constexpr int max_findings = 100;  // of each kind and channel
constexpr std::size_t progress_bytes = std::size_t{64} << 20;

/// A channel while it is read, and the findings that a later message may take back.
struct Channel {
  explicit Channel(const TypeCatalogue& types) : tally(types) {}
  ChannelTally tally;
  int undecodable = 0;
  int gaps = 0;
  std::vector<std::size_t> last_jump;  ///< by stream: index of its finding
};

class Inspector {
 public:
  Inspector(Inspection& inspection, const TypeCatalogue& types, const Timeline& timeline)
      : inspection_(inspection), types_(types), times_(timeline) {
    for (const TimeStep& step : timeline.steps()) {
      inspection_.findings.push_back({Finding::Kind::step, step.offset, step.event, step.after, "",
                                      elapsed(step.before, step.after), step.text()});
    }
    inspection_.steps = timeline.steps().size();
    inspection_.duration = timeline.duration();
  }

  void take(const LogEvent& event, SequenceCounter::Step step, std::int64_t missing) {
    if (inspection_.events++ == 0) {
      inspection_.first = inspection_.last = event.utime;
    }
    if (event.utime < inspection_.last) ++inspection_.backwards;
    inspection_.last = event.utime;
    take_number(event, step, missing);

    auto found = channels_.find(event.channel);
    if (found == channels_.end()) found = channels_.try_emplace(event.channel, types_).first;
    Channel& channel = found->second;
    const ChannelTally::Note note = channel.tally.take(times_.time(event.utime), event.data);
    if (note.kind != ChannelTally::Note::Kind::sound) {
      if (channel.undecodable++ < max_findings) add(Finding::Kind::undecodable, event, 1);
    } else if (note.step != SequenceCounter::Step::next) {
      take_seq(event, channel, note);
    }
  }

  /// Findings on channels of which nothing is known are none.
  void finish(const LogReader& reader) {
    for (auto& [name, channel] : channels_) {
      for (const auto& s : channel.tally.sessions()) inspection_.sessions[s.session] += s.messages;
      inspection_.channels.emplace(std::string(name), std::move(channel.tally));
    }
    auto& findings = inspection_.findings;
    std::erase_if(findings, [&](const Finding& f) {
      return f.kind == Finding::Kind::undecodable &&
             inspection_.channels.at(f.channel).undecodable() == 0;
    });
    for (const Damage& d : reader.damage()) {
      findings.push_back({Finding::Kind::damage, d.offset, d.after_event, d.after_utime, "",
                          static_cast<std::int64_t>(d.bytes)});
    }
    std::stable_sort(findings.begin(), findings.end(),
                     [](const Finding& a, const Finding& b) { return a.offset < b.offset; });
    inspection_.missing_events = reader.missing_events();
    inspection_.damaged_bytes = reader.damaged_bytes();
    inspection_.damaged_places = reader.damage().size();
  }

 private:
  static constexpr std::size_t none = SIZE_MAX;

  void take_number(const LogEvent& event, SequenceCounter::Step step, std::int64_t missing) {
    if (step == SequenceCounter::Step::gap || step == SequenceCounter::Step::restart) {
      last_number_ = none;
      if (file_findings_++ >= max_findings) return;
      last_number_ = inspection_.findings.size();
      add(step == SequenceCounter::Step::gap ? Finding::Kind::missing_events
                                             : Finding::Kind::restart,
          event, missing, true);
    } else if (step == SequenceCounter::Step::corrected && last_number_ != none) {
      inspection_.findings[last_number_].kind = Finding::Kind::odd_number;
    }
  }

  void take_seq(const LogEvent& event, Channel& channel, const ChannelTally::Note& note) {
    channel.last_jump.resize(std::max(channel.last_jump.size(), note.stream + 1), none);
    std::size_t& last = channel.last_jump[note.stream];
    const bool gap = note.step == SequenceCounter::Step::gap;
    if (gap || note.step == SequenceCounter::Step::restart) {
      last = none;
      if (channel.gaps++ >= max_findings) return;
      last = inspection_.findings.size();
      add(gap ? Finding::Kind::gap : Finding::Kind::restart, event, note.missing);
    } else if (note.step == SequenceCounter::Step::corrected && last != none) {
      inspection_.findings[last].kind = Finding::Kind::odd_number;
    }
  }

  void add(Finding::Kind kind, const LogEvent& event, std::int64_t count, bool of_file = false) {
    inspection_.findings.push_back({kind, event.offset, event.number, event.utime,
                                    of_file ? "" : std::string(event.channel), count});
  }

  Inspection& inspection_;
  const TypeCatalogue& types_;
  Timeline::Walker times_;
  std::unordered_map<std::string_view, Channel> channels_;  ///< names are views into the file
  int file_findings_ = 0;
  std::size_t last_number_ = none;
};

}  // namespace

Inspection inspect(const std::filesystem::path& log, const TypeCatalogue& types,
                   const std::function<void(double)>& progress) {
  LogReader reader(log);
  const Timeline timeline(reader);
  Inspection inspection;
  inspection.file = log;
  inspection.size = reader.size();
  Inspector inspector(inspection, types, timeline);
  LogEvent event;
  std::size_t next_report = progress_bytes;
  while (reader.next(event)) {
    inspector.take(event, reader.step(), reader.missing_before());
    if (progress && reader.position() >= next_report) {
      next_report += progress_bytes;
      progress(static_cast<double>(reader.position()) / static_cast<double>(reader.size()));
    }
  }
  inspector.finish(reader);
  return inspection;
}

std::int64_t Inspection::undecodable() const {
  std::int64_t sum = 0;
  for (const auto& [name, channel] : channels) sum += channel.undecodable();
  return sum;
}

std::int64_t Inspection::unknown() const {
  std::int64_t sum = 0;
  for (const auto& [name, channel] : channels) sum += channel.unknown();
  return sum;
}

std::int64_t Inspection::missing_messages() const {
  std::int64_t sum = 0;
  for (const auto& [name, channel] : channels) sum += channel.missing();
  return sum;
}

bool Inspection::sound(bool gaps_count) const {
  return events > 0 && damaged_bytes == 0 && undecodable() == 0 &&
         std::none_of(findings.begin(), findings.end(),
                      [](const Finding& f) { return f.kind == Finding::Kind::odd_number; }) &&
         (!gaps_count || (missing_events == 0 && missing_messages() == 0));
}

}  // namespace berth::logs
