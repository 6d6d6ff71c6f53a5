// SPDX-License-Identifier: BSD-3-Clause
#include "app/hardware/plc_examination.h"

#include "common/core/text.h"

namespace berth {

using State = Finding::State;

PlcExamination::PlcExamination(const PlcDevice& device, const PlcMap& map, Loop& loop)
    : map_(map),
      plc_({.device = "PLC",
            .options = {device.address, map.unit, device.timeout, device.dial_timeout},
            .first = map.status.first,
            .count = map.status.count,
            .period = device.poll_period,
            .when_unreachable = "is the PLC on, its Modbus TCP server running, the address that "
                                "of devices.yaml?",
            .when_silent = "is its program running; unit " + std::to_string(map.unit) +
                           " and registers " + std::to_string(map.status.first) + " to " +
                           std::to_string(map.status.first + map.status.count - 1) +
                           " of the map against the PLC's"},
           loop, [this](const RegisterAnswer& answer) { on_status(answer); }) {}

void PlcExamination::on_status(const RegisterAnswer& answer) {
  const auto at = static_cast<std::size_t>(map_.heartbeat - map_.status.first);
  if (!words_.empty() && words_[at] != answer.words[at]) ++beats_;
  words_ = answer.words;
}

std::vector<Finding> PlcExamination::findings() const {
  if (words_.empty()) return {plc_.connection()};
  return {connection(), plc_.timing(), chain()};
}

Finding PlcExamination::connection() const {
  Finding finding = plc_.connection();
  if (beats_ > 0) {
    finding.found += ", its heartbeat counts";
  } else {
    finding.state = State::bad;
    finding.found += ", but its heartbeat stands still";
    finding.remedy =
        "is its program running, and counts register " + std::to_string(map_.heartbeat) + " up?";
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
