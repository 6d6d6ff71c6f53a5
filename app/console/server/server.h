// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/console/server/board.h"
#include "app/console/server/command.h"

namespace berth::console {

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< numeric; any but loopback needs a token and TLS
  std::uint16_t port = 8800;          ///< 0: any that is free
  int ports_to_try = 1;               ///< from `port` on, until one is free
  std::string token;                  ///< empty: none is required
  std::filesystem::path certificate;  ///< PEM; with its key: HTTPS; empty: plain HTTP
  std::filesystem::path key;
  std::vector<std::string> hosts;  ///< additional names of this host that browsers may request

  /// Directories of files by the path at which they are served: {"/", page}, {"/lib/three/", ...}.
  std::map<std::string, std::filesystem::path> files;

  /// The mode in `hello`.
  std::string mode = "live";
  bool may_command = true;

  double frames_per_s = 20;  ///< at most, to each viewer
  std::size_t max_viewers = 32;
  std::size_t max_connections = 128;
  std::chrono::milliseconds request_time{10000};  ///< for a request to come in, headers and all
  std::chrono::milliseconds idle_time{20000};     ///< without a sign of life
};

/// An event for the node: of a page, or of a client that was refused.
struct Incoming {
  enum class Kind { joined, left, command, refused };
  Kind kind = Kind::refused;
  std::string viewer;  ///< of all but `refused`
  Command command;
  std::string code;  ///< of `refused`: a stable name, "token", "origin", "host", "frame", ...
  std::string text;  ///< for a person; of `joined`: from where
};

/// Totals since the start.
struct ServerCounters {
  std::int64_t viewers = 0;  ///< now
  std::int64_t messages = 0;
  std::int64_t bytes = 0;
  std::int64_t late_frames = 0;  ///< turns at which a viewer was still busy with its last message
  std::int64_t refused = 0;
};

/// Serves the page over HTTP and the board over a WebSocket at /live, on a thread of its own that
/// touches nothing of the caller's but the board. What comes in waits until the caller takes it:
///
///     loop.watch(server.descriptor(), [&] { for (Incoming& one : server.take()) ... });
///
/// Every function may be called from any thread.
class Server {
 public:
  /// Serves from now on. The board must outlive the server.
  /// @throws InputError for an address that cannot be listened on, files that are not there, or an
  /// address other than loopback without token and TLS
  Server(const ServerOptions& options, const Board& board);
  /// Notifies the viewers of its end, and ends its thread.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// "http://127.0.0.1:8800/"; the token is not in it.
  std::string url() const;

  /// Serves a content made by the caller, e.g. at "/mesh/replica"; replaces an earlier one.
  void offer(const std::string& path, const std::string& content_type, std::string content);

  /// Readable while something waits to be taken.
  int descriptor() const;
  /// Everything that came in since the last call, in order.
  std::vector<Incoming> take();
  /// To one viewer; to one that is gone, nothing happens.
  void answer(const std::string& viewer, const Answer& answer);

  ServerCounters counters() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth::console
