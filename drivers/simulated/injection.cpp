// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/injection.h"

#include <stdexcept>
#include <utility>

namespace berth {
void FaultTable::set(const std::string& device, const std::string& name,
                     std::function<void(double)> begin, std::function<void()> end) {
  std::size_t index = 0;
  const std::string unknown = unknown_fault(device, name, index);
  if (!unknown.empty()) throw std::logic_error(unknown);
  effects_[index] = {std::move(begin), std::move(end)};
}

std::vector<std::string> FaultTable::unset() const {
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    const FaultKind& kind = fault_kinds()[i];
    if (!effects_[i].begin) missing.push_back(kind.device + ": " + kind.name);
  }
  return missing;
}

std::string FaultTable::inject(const std::string& device, const std::string& name, double value,
                               double duration, Utime now) {
  std::size_t index = 0;
  if (const std::string unknown = unknown_fault(device, name, index); !unknown.empty())
    return unknown;
  const FaultKind& kind = fault_kinds()[index];
  if (const std::string wrong = wrong_fault_value(kind, value); !wrong.empty()) return wrong;
  constexpr double longest = 1e6;
  if (!(duration >= 0 && duration <= longest)) {
    return "the duration of '" + name + "' is not within 0 to 1000000 s";
  }
  effects_[index].begin(value);
  if (effects_[index].end) {
    active_[index] = {value, duration > 0 ? now + utime_from_seconds(duration) : 0};
  }
  return "";
}

std::string FaultTable::clear(const std::string& device, const std::string& name) {
  if (name.empty()) {
    bool known = false;
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      if (fault_kinds()[i].device != device) continue;
      known = true;
      end(i);
    }
    std::size_t index = 0;
    return known ? "" : unknown_fault(device, name, index);
  }
  std::size_t index = 0;
  const std::string unknown = unknown_fault(device, name, index);
  if (unknown.empty()) end(index);
  return unknown;
}

void FaultTable::end(std::size_t index) {
  if (active_.erase(index) > 0) effects_[index].end();
}

void FaultTable::clear_all() {
  for (std::size_t i = 0; i < effects_.size(); ++i) end(i);
}

bool FaultTable::advance(Utime now) {
  std::vector<std::size_t> over;
  for (const auto& [index, active] : active_) {
    if (active.until != 0 && active.until <= now) over.push_back(index);
  }
  for (const std::size_t index : over) end(index);
  return !over.empty();
}

Utime FaultTable::next_change() const {
  Utime next = 0;
  for (const auto& [index, active] : active_) {
    if (active.until != 0 && (next == 0 || active.until < next)) next = active.until;
  }
  return next;
}

std::vector<std::string> FaultTable::active() const {
  std::vector<std::string> list;
  for (const auto& [index, active] : active_) {
    const FaultKind& kind = fault_kinds()[index];
    list.push_back(kind.device + ": " + kind.name + text_of(kind.value, active.value));
  }
  return list;
}

}  // namespace berth
