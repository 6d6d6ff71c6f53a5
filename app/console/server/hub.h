// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

#include "app/console/server/access.h"
#include "app/console/server/contents.h"
#include "app/console/server/inbox.h"
#include "app/console/server/server.h"

namespace berth::console {

/// A viewer's WebSocket, whatever it runs over. On the server's thread.
class ViewerLink {
 public:
  using Text = std::shared_ptr<const std::string>;

  virtual ~ViewerLink() = default;
  /// All that was sent before has left.
  virtual bool idle() const = 0;
  virtual void send(Text text) = 0;
  /// The server goes.
  virtual void close_going_away() = 0;
};

/// State shared by the connections of a server: the viewers, the revision that each has, and the
/// limits on their number and rate. On the server's thread, but for the inbox, the contents and the
/// counters.
class Hub {
 public:
  Hub(const ServerOptions& with, const Board& of);

  /// A name for a viewer whose link is up. It is sent `hello`, and from then on its frames.
  std::string join(const std::shared_ptr<ViewerLink>& link, const std::string& from);
  void leave(const std::string& viewer);
  bool full() const { return viewers_.size() >= options.max_viewers; }
  void command(const std::string& viewer, Command command);
  void answer(const std::string& viewer, const Answer& answer);

  /// Brings every viewer that is not busy up to date; called frames_per_s times a second.
  void send_frames();
  void close_all();

  ServerCounters counters() const;
  /// Sent on the wire, for the counters.
  void sent(std::size_t bytes);

  const ServerOptions options;
  const Access access;
  Contents contents;
  Inbox inbox;
  unsigned port = 0;
  std::size_t connections = 0;

 private:
  struct Viewer {
    std::weak_ptr<ViewerLink> link;
    std::uint64_t revision = 0;
    int turns_without_news = 0;
  };

  const Board& board_;
  std::map<std::string, Viewer> viewers_;
  int last_viewer_ = 0;
  std::atomic<std::int64_t> viewer_count_{0};
  std::atomic<std::int64_t> messages_{0};
  std::atomic<std::int64_t> bytes_{0};
  std::atomic<std::int64_t> late_frames_{0};
};

}  // namespace berth::console
