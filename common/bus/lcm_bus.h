// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "common/bus/bus.h"
#include "common/bus/process_loop.h"

namespace berth {

/// The bus of the lab: LCM over UDP multicast. A receive thread only enqueues; handlers run on the
/// loop. Subscribe everything, then start().
class LcmBus final : public Bus {
 public:
  /// url: "udpm://239.255.76.67:7667?ttl=0"; empty: the environment's LCM_DEFAULT_URL, else that one.
  /// Separate two testbeds on one network by port, never by group alone.
  /// @throws InputError for a URL that LCM does not understand or a network without a multicast route.
  LcmBus(const std::string& url, ProcessLoop& loop);
  ~LcmBus() override;

  void start();
  BusCounters counters() const override;

  static constexpr char default_url[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

 protected:
  void send(const std::string& channel, Bytes bytes) override;
  void receive(const std::string& channel, Queue queue, RawHandler handler) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
