// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/event_queue.h"

#include <algorithm>
#include <utility>

namespace berth {

void EventQueue::push(Utime when, std::uint32_t slot) {
  heap_.push_back({when, ++order_, slot, slots_[slot].uses});
  std::push_heap(heap_.begin(), heap_.end(), Later());
}

void EventQueue::pop() {
  std::pop_heap(heap_.begin(), heap_.end(), Later());
  heap_.pop_back();
}

void EventQueue::release(std::uint32_t slot) {
  slots_[slot].event = {};
  ++slots_[slot].uses;
  free_.push_back(slot);
}

Loop::TimerId EventQueue::add(Utime when, Event event) {
  if (free_.empty()) {
    free_.push_back(static_cast<std::uint32_t>(slots_.size()));
    slots_.emplace_back();
  }
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  slots_[slot].event = std::move(event);
  push(when, slot);
  return Loop::TimerId{slots_[slot].uses} << 32 | slot;
}

void EventQueue::cancel(Loop::TimerId timer) {
  const auto slot = static_cast<std::uint32_t>(timer);
  if (slot < slots_.size() && slots_[slot].uses == timer >> 32) release(slot);
}

std::optional<Utime> EventQueue::next() {
  while (!heap_.empty() && slots_[heap_.front().slot].uses != heap_.front().uses) pop();
  if (heap_.empty()) return std::nullopt;
  return heap_.front().when;
}

EventQueue::Event EventQueue::take() {
  const Entry entry = heap_.front();
  pop();
  Event& event = slots_[entry.slot].event;
  if (event.period > 0) {
    push(entry.when + event.period, entry.slot);
    return event;
  }
  Event once = std::move(event);
  release(entry.slot);
  return once;
}

}  // namespace berth
