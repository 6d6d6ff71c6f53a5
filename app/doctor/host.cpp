// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor/host.h"

#include <arpa/inet.h>
#include <sys/timex.h>
#include <unistd.h>

#include <berth/event_t.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "app/runs/active_runs.h"
#include "common/bus/lcm_bus.h"
#include "common/core/error.h"

namespace berth {
namespace {

using State = Finding::State;

/// Interface over which the group is reached, by the kernel's table; empty: none.
std::string interface_to(const std::string& group) {
  in_addr to{};
  inet_pton(AF_INET, group.c_str(), &to);
  std::ifstream table("/proc/net/route");
  std::string line;
  std::getline(table, line);  // heading
  std::string best;
  std::uint32_t best_mask = 0;
  while (std::getline(table, line)) {
    std::istringstream words(line);
    std::string interface, destination, gateway, flags, skip, mask;
    words >> interface >> destination >> gateway >> flags >> skip >> skip >> skip >> mask;
    const auto number = [](const std::string& hex) {
      return static_cast<std::uint32_t>(std::strtoul(hex.c_str(), nullptr, 16));
    };
    const std::uint32_t bits = number(mask);
    if ((to.s_addr & bits) != number(destination)) continue;
    if (best.empty() || ntohl(bits) > ntohl(best_mask)) {
      best = interface;
      best_mask = bits;
    }
  }
  return best;
}

Finding multicast_route(const std::string& url) {
  const auto start = std::string("udpm://").size();
  const std::string group = url.substr(start, url.find(':', start) - start);
  const std::string interface = interface_to(group);
  if (interface.empty()) {
    return {State::bad, "multicast route", "no route to " + group,
            "ip link set lo up && ip route add 224.0.0.0/4 dev lo"};
  }
  return {State::good, "multicast route", group + " goes over " + interface, ""};
}

Finding receive_buffer() {
  std::ifstream in("/proc/sys/net/core/rmem_max");
  long bytes = 0;
  in >> bytes;
  const std::string found = "at most " + std::to_string(bytes / 1024) + " kB";
  if (bytes >= 4194304) return {State::good, "receive buffer", found, ""};
  return {State::warning, "receive buffer", found + ": bursts of scans may be lost",
          "sysctl -w net.core.rmem_max=4194304"};
}

Finding loopback(const std::string& url) {
  constexpr int count = 50;
  ProcessLoop loop(clock_offset_now());
  try {
    LcmBus bus(url, loop);
    int received = 0;
    // A channel of its own, to which no other program listens.
    const std::string channel = "BERTH_DOCTOR_" + std::to_string(getpid());
    bus.subscribe<event_t>(channel, Queue::fifo(), [&](const event_t&) {
      if (++received == count) loop.stop();
    });
    bus.start();
    event_t message{};
    message.text.assign(50000, '.');
    int sent = 0;
    loop.every(5 * millisecond, [&] {
      if (sent++ < count) bus.publish(channel, message);
    });
    loop.after(3 * second, [&] { loop.stop(); });
    loop.run();
    const std::string found =
        std::to_string(received) + " of " + std::to_string(count) + " messages of 50 kB came back";
    if (received == count) return {State::good, "loopback", found, ""};
    return {State::bad, "loopback", found,
            "check the firewall for UDP multicast: iptables -L -n | grep 239.255"};
  } catch (const InputError& e) {
    return {State::bad, "loopback", e.what(), "mend the multicast route first"};
  }
}

Finding recorder() {
  const char* const places = std::getenv("PATH");
  std::istringstream path(places != nullptr ? places : "");
  std::string directory;
  while (std::getline(path, directory, ':')) {
    if (access((directory + "/lcm-logger").c_str(), X_OK) == 0) {
      return {State::good, "recorder", directory + "/lcm-logger", ""};
    }
  }
  return {State::bad, "recorder", "no lcm-logger in PATH", "apt-get install liblcm-bin"};
}

Finding disk() {
  const auto space = std::filesystem::space(".");
  const double gigabytes = static_cast<double>(space.available) / 1e9;
  char found[64];
  std::snprintf(found, sizeof found, "%.1f GB free here", gigabytes);
  // A night of scans at full rate is about 2.4 GB an hour.
  if (gigabytes >= 5) return {State::good, "disk", found, ""};
  return {gigabytes >= 0.5 ? State::warning : State::bad, "disk", found,
          "remove old runs: du -sh runs/* | sort -h"};
}

Finding clock() {
  timex state{};
  const int result = adjtimex(&state);
  if (result >= 0 && result != TIME_ERROR && (state.status & STA_UNSYNC) == 0) {
    char found[64];
    std::snprintf(found, sizeof found, "synchronised, within %.1f ms",
                  static_cast<double>(state.maxerror) * 1e-3);
    return {State::good, "clock", found, ""};
  }
  return {State::warning, "clock",
          "not synchronised: the hours in logs may be wrong; runs are not touched",
          "apt-get install chrony"};
}

Finding other_runs(const std::string& url) {
  for (const auto& run : active_runs()) {
    if (run.url == url) {
      return {State::warning, "bus", "a run uses it: " + run.directory.string(),
              "berth attach, berth stop, or another --lcm-url"};
    }
  }
  return {State::good, "bus", url, ""};
}

}  // namespace

std::vector<Finding> examine(const std::string& url) {
  const std::string used = bus_url(url);
  return {multicast_route(used), receive_buffer(), loopback(used), recorder(), disk(), clock(),
          other_runs(used)};
}

}  // namespace berth
