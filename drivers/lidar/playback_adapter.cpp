// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/playback_adapter.h"

#include <algorithm>

#include "common/core/error.h"
#include "drivers/lidar/limits.h"

namespace berth::lidar {
namespace {

constexpr std::size_t beams_per_message = 50;
constexpr Utime redial = 500 * millisecond;

}  // namespace

PlaybackAdapter::PlaybackAdapter(std::unique_ptr<Recording> recording, PlaybackSettings settings,
                                 const LidarProfile& profile, Loop& loop)
    : recording_(std::move(recording)),
      settings_(settings),
      identity_(identity_of(profile, "(recorded)")),
      loop_(loop) {}

PlaybackAdapter::~PlaybackAdapter() { loop_.cancel(timer_); }

void PlaybackAdapter::start(Events events) {
  events_ = std::move(events);
  become_ready(0);
}

void PlaybackAdapter::become_ready(Utime wait) {
  timer_ = loop_.after(wait, [this] {
    ready_ = true;
    reason_.clear();
    events_.ready();
  });
}

std::optional<RecordedScan> PlaybackAdapter::next_scan(std::string& refusal) {
  try {
    auto scan = recording_->next();
    if (!scan && settings_.repeat && played_ > 0) {
      recording_->rewind();
      anchored_ = false;
      scan = recording_->next();
    }
    if (!scan) {
      refusal = "the recording " + name() + " is over after " + std::to_string(played_) + " scans";
    }
    return scan;
  } catch (const InputError& e) {
    refusal = e.what();
    return std::nullopt;
  }
}

void PlaybackAdapter::order(const ScanOrder& order) {
  ScanAnswer answer;
  answer.scan_id = order.scan_id;
  auto scan = next_scan(answer.reason);
  answer.accepted = scan.has_value();
  if (!scan) {
    // From the loop, as an answer over a wire would come.
    timer_ = loop_.after(0, [this, answer] { events_.message(answer); });
    return;
  }
  ++played_;
  answer.beams = static_cast<std::uint32_t>(scan->beams.size());
  const Utime now = loop_.now();
  if (!scan->beams.empty()) {
    const Utime first = scan->beams.front().utime;
    const Utime gap = std::clamp<Utime>(on_clock(first) - now, 0, settings_.max_gap);
    const bool follows = anchored_ && scan->timed;
    shift_ = now + (follows ? gap : std::min(scan->delay, settings_.max_gap)) - first;
    anchored_ = scan->timed;
  }
  playing_ = Playing{order.scan_id, order.windows.size(), std::move(*scan), 0};
  timer_ = loop_.after(0, [this, answer] {
    events_.message(answer);
    if (playing_) schedule();
  });
}

void PlaybackAdapter::schedule() {
  const auto& beams = playing_->scan.beams;
  if (playing_->next == beams.size()) {
    const std::string& failure = playing_->scan.failure;
    return end(failure.empty() ? ScanResult::complete : ScanResult::failed,
               failure.empty() ? "" : "as recorded: " + failure);
  }
  std::size_t last = playing_->next;
  while (last + 1 < beams.size() && last + 1 - playing_->next < beams_per_message &&
         beams[last + 1].window == beams[playing_->next].window) {
    ++last;
  }
  timer_ = loop_.at(std::max(loop_.now(), on_clock(beams[last].utime)), [this] { play(); });
}

void PlaybackAdapter::play() {
  const auto& beams = playing_->scan.beams;
  std::size_t& next = playing_->next;
  const RecordedBeam& first = beams[next];
  Returns returns;
  returns.scan_id = playing_->id;
  returns.window =
      static_cast<std::uint16_t>(std::min<std::size_t>(first.window, playing_->windows - 1));
  returns.beams_before = static_cast<std::uint32_t>(next);
  returns.device_time = on_clock(first.utime);
  for (; next < beams.size() && returns.beams.size() < beams_per_message &&
         beams[next].window == first.window;
       ++next) {
    returns.beams.push_back(beams[next].beam);
    returns.beams.back().after_us = static_cast<std::uint32_t>(beams[next].utime - first.utime);
  }
  events_.message(returns);
  if (playing_) schedule();
}

void PlaybackAdapter::end(ScanResult result, const std::string& reason) {
  ScanEnd message;
  message.scan_id = playing_->id;
  message.result = result;
  message.beams = static_cast<std::uint32_t>(playing_->next);
  message.device_time = loop_.now();
  message.reason = reason;
  playing_.reset();
  events_.message(message);
}

void PlaybackAdapter::cancel(std::int64_t scan_id) {
  if (!playing_ || playing_->id != scan_id) return;
  loop_.cancel(timer_);
  timer_ = loop_.after(0, [this] {
    if (playing_) end(ScanResult::cancelled, "");
  });
}

void PlaybackAdapter::drop(const std::string& reason) {
  loop_.cancel(timer_);
  playing_.reset();
  ready_ = false;
  reason_ = reason;
  become_ready(redial);
  events_.lost(reason);
}

}  // namespace berth::lidar
