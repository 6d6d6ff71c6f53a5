// SPDX-License-Identifier: BSD-3-Clause
#include "app/hardware/plc_examination.h"

#include "common/core/text.h"

namespace berth {

using State = Finding::State;

PlcExamination::PlcExamination(PlcDevice device, const PlcMap& map, Loop& loop)
    : device_(std::move(device)),
      map_(map),
      loop_(loop),
      link_(make_register_link(loop,
                               {device_.address, map.unit, device_.timeout, device_.dial_timeout},
                               [this](bool up, const std::string& why) {
                                 connected_ = connected_ || up;
                                 if (!up) unreachable_ = why;
                               })),
      timer_(loop.every(device_.poll_period, [this] { poll(); })) {}

PlcExamination::~PlcExamination() { loop_.cancel(timer_); }

void PlcExamination::poll() {
  if (under_way_ || !link_->connected()) return;
  under_way_ = true;
  link_->read_registers(map_.status.first, map_.status.count, [this](const RegisterAnswer& answer) {
    under_way_ = false;
    if (!answer.ok()) return round_trips_.miss(answer.error);
    round_trips_.add(answer.received - answer.sent);
    const auto at = static_cast<std::size_t>(map_.heartbeat - map_.status.first);
    if (!words_.empty() && words_[at] != answer.words[at]) ++beats_;
    words_ = answer.words;
  });
}

std::vector<Finding> PlcExamination::findings() const {
  std::vector<Finding> list{connection()};
  if (list.front().state == State::bad) return list;
  list.push_back(round_trips_.finding("PLC", device_.poll_period, device_.timeout));
  list.push_back(chain());
  return list;
}

Finding PlcExamination::connection() const {
  Finding finding;
  finding.subject = "PLC connection";
  finding.found = device_.address;
  const std::string unit = std::to_string(map_.unit);
  if (!connected_) {
    finding.state = State::bad;
    finding.found += unreachable_.empty() ? ": nobody answers" : ": " + unreachable_;
    finding.remedy =
        "is the PLC on, its Modbus TCP server running, the address that of "
        "devices.yaml?";
  } else if (round_trips_.answered() == 0) {
    finding.state = State::bad;
    finding.found += " takes connections, but answers no read: " +
                     (round_trips_.why().empty() ? unreachable_ : round_trips_.why());
    finding.remedy = "is its program running; unit " + unit + " and registers " +
                     std::to_string(map_.status.first) + " to " +
                     std::to_string(map_.status.first + map_.status.count - 1) +
                     " of the map against the PLC's";
  } else if (beats_ == 0) {
    finding.state = State::bad;
    finding.found += " answers as unit " + unit + ", but its heartbeat stands still";
    finding.remedy =
        "is its program running, and counts register " + std::to_string(map_.heartbeat) + " up?";
  } else {
    finding.found += " answers as unit " + unit + ", its heartbeat counts";
  }
  return finding;
}

Finding PlcExamination::chain() const {
  const int safety = words_[static_cast<std::size_t>(map_.safety - map_.status.first)];
  const auto is_set = [&](int bit) { return (safety >> bit & 1) != 0; };
  Finding finding;
  finding.subject = "PLC safety chain";
  finding.found = std::string("E-stop chain ") + (is_set(map_.estop_bit) ? "closed" : "open") +
                  ", fence " + (is_set(map_.fence_bit) ? "closed" : "open") + ", motion " +
                  (is_set(map_.motion_bit) ? "enabled" : "not enabled");
  if (is_set(map_.estop_bit) && is_set(map_.fence_bit) && is_set(map_.motion_bit)) return finding;
  finding.state = State::warning;
  finding.remedy = "nothing moves until all three are so; if they are: the bits of the map";
  return finding;
}

}  // namespace berth
