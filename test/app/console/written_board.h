// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/console/view/section.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_event.h"
#include "logs/types/type_catalogue.h"

namespace berth::console {

/// A board that keeps what was written last, and how often.
class WrittenBoard : public Sink {
 public:
  using Json = nlohmann::ordered_json;

  void at(Utime utime) override { time = utime; }
  void set(const std::string& section, std::string json) override {
    sections[section] = Json::parse(json);
    ++writes[section];
  }
  void add(const std::string& list, std::string json) override {
    for (auto& entry : Json::parse("[" + json + "]")) lists[list].push_back(entry);
  }
  void reset(const std::string& list) override { lists[list] = Json::array(); }

  Utime time = 0;
  std::map<std::string, Json> sections;
  std::map<std::string, Json> lists;
  std::map<std::string, int> writes;
};

inline const logs::TypeCatalogue& own_types() {
  static const logs::TypeCatalogue types = [] {
    logs::TypeCatalogue own;
    own.add("lcmtypes");
    return own;
  }();
  return types;
}

/// A message as a view gets it.
struct Event {
  template <class Message>
  Event(std::string on, const Message& message, Utime received)
      : channel(std::move(on)), bytes(static_cast<std::size_t>(message.getEncodedSize())) {
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    event.utime = received;
    event.channel = channel;
    event.data = bytes;
  }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  std::string channel;
  std::vector<std::uint8_t> bytes;
  logs::LogEvent event;
};

}  // namespace berth::console
