// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/process_loop.h"

namespace berth {

/// The URL to use: the one given, else the environment's LCM_DEFAULT_URL, else
/// udpm://239.255.76.67:7667?ttl=0; with the largest receive buffer that the kernel allows, up to 4
/// MB.
/// @throws InputError for another provider or an option that LCM would silently ignore.
std::string bus_url(const std::string& given);

/// The bus of the lab: LCM over UDP multicast. A receive thread only enqueues; handlers run on the
/// loop, which must outlive the bus and must not run any more when the bus is destroyed. Subscribe
/// everything, then start(). Separate two testbeds on one network by port, never by group alone.
class LcmBus final : public Bus {
 public:
  /// @throws InputError as bus_url, or for a network without a multicast route.
  LcmBus(const std::string& url, ProcessLoop& loop);
  ~LcmBus() override;

  void start();
  /// Every message of every channel, undecoded: for displays.
  using AnyHandler = std::function<void(const std::string& channel, Bytes)>;
  void subscribe_all(Queue queue, AnyHandler handler);
  BusCounters counters() const override;

 protected:
  void send(const std::string& channel, Bytes bytes) override;
  void receive(const std::string& channel, Queue queue, RawHandler handler) override;

 private:
  void subscribe_pattern(const std::string& pattern, Queue queue, AnyHandler handler);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
