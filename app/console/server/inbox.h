// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "app/console/server/server.h"

namespace berth::console {

/// Input that waits to be taken by the node. From any thread.
class Inbox {
 public:
  Inbox();
  ~Inbox();
  Inbox(const Inbox&) = delete;
  Inbox& operator=(const Inbox&) = delete;

  int descriptor() const { return fd_; }
  /// False when too much waits already: it is not kept.
  bool put(Incoming incoming);
  /// A client was refused. Of one kind the first in a second is reported at once, the others as a
  /// number, so that an attack does not become one on the log.
  void refuse(const std::string& code, const std::string& text);
  /// Reports the numbers that are due; called now and then.
  void report_more();
  std::vector<Incoming> take();
  std::int64_t refused() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Kind {
    Clock::time_point reported;
    std::int64_t more = 0;
    std::string last;
  };

  void keep(Incoming incoming);

  int fd_;
  mutable std::mutex mutex_;
  std::vector<Incoming> waiting_;
  std::map<std::string, Kind> refusals_;
  std::int64_t refused_ = 0;
};

}  // namespace berth::console
