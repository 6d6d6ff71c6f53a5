// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/access.h"

#include <arpa/inet.h>
#include <openssl/crypto.h>

#include <algorithm>
#include <array>

#include "app/host_name.h"
#include "common/core/sha256.h"

namespace berth::console {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

/// "cell:8800" is "cell", "[::1]:8800" is "::1"; empty when it is neither.
std::string without_port(const std::string& host) {
  if (!host.empty() && host.front() == '[') {
    const auto end = host.find(']');
    return end == std::string::npos ? "" : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool is_address(const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return inet_pton(AF_INET, text.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1;
}

std::string cookie_name(unsigned port) { return "berth_" + std::to_string(port); }

/// The value of NAME=VALUE in a list with the separator given; empty when it is not there.
std::string value_in(const std::string& list, char separator, const std::string& name) {
  for (std::size_t at = 0; at < list.size();) {
    auto end = list.find(separator, at);
    if (end == std::string::npos) end = list.size();
    const auto start = list.find_first_not_of(' ', at);
    if (start < end && list.compare(start, name.size() + 1, name + '=') == 0) {
      return list.substr(start + name.size() + 1, end - start - name.size() - 1);
    }
    at = end + 1;
  }
  return "";
}

std::string query_of(const std::string& target) {
  const auto question = target.find('?');
  return question == std::string::npos ? "" : target.substr(question + 1);
}

}  // namespace

bool same_secret(const std::string& one, const std::string& other) {
  // Digests are equally long, whatever the texts.
  const std::string a = sha256(one);
  const std::string b = sha256(other);
  return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string harmless(const std::string& text) {
  constexpr std::size_t max_length = 80;
  std::string shown = text.substr(0, max_length);
  for (char& c : shown) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text.size() > max_length ? shown + "..." : shown;
}

Access::Access(std::string token, std::vector<std::string> hosts, bool secure)
    : token_(std::move(token)), hosts_(std::move(hosts)), secure_(secure) {
  hosts_.push_back(host_name());
  hosts_.push_back("localhost");
  for (std::string& host : hosts_) host = lower(host);
}

bool Access::knows_host(const std::string& host) const {
  // A page of another site that had its own name resolve to this host would request that name.
  const std::string name = lower(without_port(host));
  return is_address(name) || std::find(hosts_.begin(), hosts_.end(), name) != hosts_.end();
}

bool Access::has_token(const PageRequest& request, unsigned port) const {
  if (same_secret(value_in(request.cookie, ';', cookie_name(port)), token_)) return true;
  const std::string scheme = "Bearer ";
  return request.authorization.rfind(scheme, 0) == 0 &&
         same_secret(request.authorization.substr(scheme.size()), token_);
}

Verdict Access::judge(const PageRequest& request, unsigned port) const {
  if (!knows_host(request.host)) {
    return {421, "host", "This server is not '" + harmless(request.host) + "'.", "", ""};
  }
  // Before plain HTTP a proxy may stand that speaks TLS.
  const std::string origin = lower(request.origin);
  const std::string host = lower(request.host);
  const bool own = origin == "https://" + host || (!secure_ && origin == "http://" + host);
  if (!origin.empty() && !own) {
    return {403, "origin", "Pages of '" + harmless(request.origin) + "' are not served.", "", ""};
  }
  if (request.method != "GET" && request.method != "HEAD") {
    return {405, "method", "Only GET and HEAD.", "", ""};
  }
  if (token_.empty() || has_token(request, port)) return {};
  const std::string given = value_in(query_of(request.target), '&', "token");
  if (!given.empty() && same_secret(given, token_)) {
    // From here on as a cookie, so that the address that a browser shows and keeps has none.
    std::string root = "./";  // relative: a proxy may have put a path before it
    const auto depth = std::count(
        request.target.begin(),
        request.target.begin() + static_cast<std::ptrdiff_t>(request.target.find('?')), '/');
    for (std::ptrdiff_t i = 1; i < depth; ++i) root += "../";
    return {303, "", "", root,
            cookie_name(port) + "=" + token_ + "; Path=/; HttpOnly; SameSite=Strict" +
                (secure_ ? "; Secure" : "")};
  }
  const bool wrong = !given.empty() || !request.authorization.empty() ||
                     !value_in(request.cookie, ';', cookie_name(port)).empty();
  return {401, wrong ? "token-wrong" : "token-missing",
          wrong ? "The token is not right."
                : "A token is needed: open this address once with ?token=... behind it.",
          "", ""};
}

}  // namespace berth::console
