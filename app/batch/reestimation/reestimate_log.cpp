// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/reestimation/reestimate_log.h"

#include <algorithm>
#include <berth/pose_estimate_t.hpp>
#include <berth/run_info_t.hpp>
#include <chrono>
#include <deque>
#include <limits>

#include "app/batch/reestimation/estimator_fold.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/statistics.h"
#include "evaluation/run/own_estimator.h"
#include "evaluation/run/run_record.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_reader.h"
#include "logs/file/log_writer.h"
#include "logs/file/timeline.h"

namespace berth {
namespace {

using Buffer = std::vector<std::uint8_t>;

double wall_clock() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

template <class Message>
Buffer encode(const Message& message) {
  Buffer bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Median time from a packet to the next estimate, over the first few.
Utime usual_delay(const std::filesystem::path& log) {
  constexpr std::size_t enough = 51;
  logs::LogReader reader(log);
  logs::LogEvent event;
  Utime last_packet = 0;
  std::vector<Utime> delays;
  while (delays.size() < enough && reader.next(event)) {
    if (event.channel == channels::scan_data) {
      last_packet = event.utime;
    } else if (event.channel == channels::pose_estimate && last_packet != 0) {
      delays.push_back(std::max<Utime>(0, event.utime - last_packet));
      last_packet = 0;
    }
  }
  return delays.empty() ? 0 : upper_median(std::move(delays));
}

/// Counts the estimates that two streams have in common, one after the other.
class SameEstimates {
 public:
  void recorded(Bytes bytes) { take(bytes, recorded_, computed_); }
  void computed(Bytes bytes) { take(bytes, computed_, recorded_); }
  std::int64_t count() const { return count_; }

 private:
  void take(Bytes bytes, std::deque<Buffer>& own, std::deque<Buffer>& other) {
    auto message = logs::decode<pose_estimate_t>(bytes);
    if (!message) return;
    message->seq = 0;
    own.push_back(encode(*message));
    if (other.empty()) return;
    if (own.front() == other.front()) ++count_;
    own.pop_front();
    other.pop_front();
  }

  std::deque<Buffer> recorded_;
  std::deque<Buffer> computed_;
  std::int64_t count_ = 0;
};

/// RUN_INFO with the files of the configuration as they are now. The same bytes when nothing is
/// other than it was.
Buffer with_configuration(const logs::LogEvent& event, const RunFiles& run) {
  auto info = logs::decode<run_info_t>(event.data);
  if (!info) return {event.data.begin(), event.data.end()};
  bool changed = evaluation::forget_own_estimator(*info);
  for (attachment_t& attachment : info->attachments) {
    const auto file = run.setup.config / attachment.name;
    if (attachment.name == "procedure.yaml" || !std::filesystem::exists(file)) continue;
    std::string content = read_file(file);
    std::string hash = sha256(content);
    if (hash == attachment.sha256) continue;
    changed = true;
    attachment.sha256 = std::move(hash);
    const bool fits = content.size() <= attachment.content.size() + 4096;
    attachment.content = fits ? std::move(content) : "";
  }
  if (changed) info->configuration_hash = run.configuration_hash;
  return encode(*info);
}

/// The verdict rested on the recorded estimates; the new ones are counted otherwise.
bool is_verdict_basis(const logs::LogEvent& event) {
  if (event.channel == channels::verdict_basis) return true;
  if (event.channel != channels::event) return false;
  const auto decoded = logs::decode<event_t>(event.data);
  return decoded && decoded->code == evaluation::judged_event_code;
}

/// Writes the new log: recorded messages and new ones, each at its time.
class NewLog {
 public:
  NewLog(const std::filesystem::path& path, Utime delay) : writer_(path), delay_(delay) {}

  void published(Utime now, const std::string& channel, Bytes bytes) {
    waiting_.push_back({now + delay_, channel, {bytes.begin(), bytes.end()}});
  }
  void write_recorded(const logs::LogEvent& event, Bytes bytes) {
    write_published_before(event.utime);
    writer_.write(event.utime, std::string(event.channel), bytes);
  }
  void finish() {
    write_published_before(std::numeric_limits<Utime>::max());
    writer_.flush();
  }

 private:
  struct Published {
    Utime utime;
    std::string channel;
    Buffer bytes;
  };

  void write_published_before(Utime utime) {
    while (!waiting_.empty() && waiting_.front().utime <= utime) {
      const Published& message = waiting_.front();
      writer_.write(message.utime, message.channel, message.bytes);
      waiting_.pop_front();
    }
  }

  logs::LogWriter writer_;
  Utime delay_;
  std::deque<Published> waiting_;  // in order of time: the delay is the same for all
};

}  // namespace

Reestimation reestimate_log(const std::filesystem::path& log, const RunFiles& new_run,
                            const ShareDone& share_done) {
  const double begin = wall_clock();
  Reestimation result;
  NewLog written(new_run.log(), usual_delay(log));
  SameEstimates same;
  std::unique_ptr<EstimatorFold> fold;
  const auto outlet = [&](Utime now, const std::string& channel, Bytes bytes) {
    if (channel == channels::pose_estimate) {
      ++result.estimates;
      same.computed(bytes);
    }
    written.published(now, channel, bytes);
  };

  logs::LogReader reader(log);
  const logs::Timeline timeline(reader);
  logs::Timeline::Walker times(timeline);
  logs::LogEvent event;
  Utime first = 0;
  Utime last = 0;
  std::size_t bytes_read = 0;
  while (reader.next(event)) {
    event.utime = times.time(event.utime);
    if (!fold) {
      first = event.utime;
      fold = std::make_unique<EstimatorFold>(new_run, first,
                                             [&](const std::string& channel, Bytes bytes) {
                                               outlet(fold ? fold->now() : first, channel, bytes);
                                             });
    }
    last = event.utime;
    bytes_read += logs::format::header_bytes + event.channel.size() + event.data.size();
    if (event.channel == channels::pose_estimate) {
      ++result.recorded;
      same.recorded(event.data);
    }
    if (event.channel == channels::run_info) {
      written.write_recorded(event, with_configuration(event, new_run));
    } else if (!EstimatorFold::is_output(event) && !is_verdict_basis(event)) {
      written.write_recorded(event, event.data);
    }
    if (EstimatorFold::is_input(event)) {
      const double start = wall_clock();
      fold->take(event);
      result.estimator_s += wall_clock() - start;
    } else {
      fold->take(event);
    }
    if (share_done && reader.events() % 1000 == 0) {
      share_done(static_cast<double>(bytes_read) / static_cast<double>(reader.size()));
    }
  }
  written.finish();
  result.same = same.count();
  result.recorded_s = seconds(last - first);
  result.wall_s = wall_clock() - begin;
  return result;
}

}  // namespace berth
