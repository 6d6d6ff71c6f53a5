// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth::console {

/// Parts of a request that decide whether it is served: header fields as they came, empty where
/// missing.
struct PageRequest {
  std::string method;
  std::string target;
  std::string host;
  std::string origin;
  std::string cookie;
  std::string authorization;
};

/// The decision.
struct Verdict {
  int status = 200;      ///< HTTP; 303: go to `location`
  std::string code;      ///< of a refusal, a stable name; empty: none
  std::string text;      ///< for the requester
  std::string location;  ///< of 303
  std::string cookie;    ///< to set, of 303
};

/// Access to the page: permitted viewers and addresses.
class Access {
 public:
  /// token: empty: none is needed. hosts: names under which this host may be requested besides
  /// "localhost", its own name and numeric addresses. secure: served over TLS.
  Access(std::string token, std::vector<std::string> hosts, bool secure);

  /// `port`: the one that is listened on; a browser keeps one cookie for each.
  Verdict judge(const PageRequest& request, unsigned port) const;

 private:
  bool knows_host(const std::string& host) const;
  bool has_token(const PageRequest& request, unsigned port) const;

  std::string token_;
  std::vector<std::string> hosts_;
  bool secure_;
};

/// Compares in a time that does not depend on where the texts differ.
bool same_secret(const std::string& one, const std::string& other);

/// Foreign text for a log or a terminal: printable ASCII, and not much of it.
std::string harmless(const std::string& text);

}  // namespace berth::console
