// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/serving.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>

#include "app/console/server/credentials.h"
#include "app/runs/run_files.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::console {
namespace fs = std::filesystem;
namespace {

constexpr int ports_to_try = 200;
const fs::path libraries = "/usr/share/javascript";

fs::path page_directory() {
  const fs::path in_source = shared_files() / "app" / "console" / "page";
  return fs::exists(in_source) ? in_source : shared_files() / "console";
}

fs::path library(const std::string& name) {
  if (!fs::is_directory(libraries / name)) {
    throw InputError((libraries / name).string() + " is not there: install libjs-" + name);
  }
  return libraries / name;
}

fs::path address_file(const fs::path& run) { return run / "output" / "console.url"; }

}  // namespace

ConsoleConfig load_console_config(const fs::path& directory) {
  ConsoleConfig console;
  console.server.ports_to_try = ports_to_try;
  const fs::path file = directory / "console.yaml";
  if (!fs::exists(file)) return console;
  Config config = Config::load(file);
  config.optional("start", console.start);
  config.optional("listen", console.server.address);
  int port = console.server.port;
  config.optional("port", port, within(0, 65535));
  console.server.port = static_cast<std::uint16_t>(port);
  config.optional("hosts", console.server.hosts);
  const auto optional_path = [&config](const std::string& key, fs::path& path) {
    std::string text;
    config.optional(key, text);
    if (!text.empty()) path = text;
  };
  optional_path("token_file", console.token_file);
  optional_path("certificate", console.server.certificate);
  optional_path("key", console.server.key);
  config.optional("rate", Dimension::frequency, console.server.frames_per_s, within(0.1, 60));
  int viewers = static_cast<int>(console.server.max_viewers);
  config.optional("viewers", viewers, at_least(1));
  console.server.max_viewers = static_cast<std::size_t>(viewers);
  // A browser requests files over some connections in addition to its viewer's.
  console.server.max_connections = 64 + 2 * console.server.max_viewers;
  config.optional_choice("on_loss_of_control", console.hold_on_loss,
                         {{"hold", true}, {"nothing", false}});
  config.finish();
  return console;
}

void ServingOptions::add_to(CLI::App& command) {
  command.add_option("--listen", listen_,
                     "Address to serve at; any but 127.0.0.1 and ::1 needs token and certificate");
  command.add_option("--port", port_, "Port, or the next free one; 0: any that is free")
      ->check(CLI::Range(0, 65535));
  command.add_option("--token-file", token_file_,
                     "File that holds the token, readable by its owner alone");
  command.add_option("--certificate", certificate_, "Certificate (PEM): serve over TLS");
  command.add_option("--key", key_, "The certificate's key (PEM)");
  command.add_option("--host", hosts_, "Another name by which browsers may request this host")
      ->type_name("NAME")
      ->allow_extra_args(false);
}

bool ServingOptions::given() const { return !arguments().empty(); }

std::vector<std::string> ServingOptions::arguments() const {
  std::vector<std::string> words;
  const auto add = [&words](const std::string& option, const std::string& value) {
    if (value.empty()) return;
    words.push_back(option);
    words.push_back(value);
  };
  const auto absolute = [](const fs::path& path) {
    return path.empty() ? "" : fs::absolute(path).string();
  };
  add("--listen", listen_);
  add("--port", port_ < 0 ? "" : std::to_string(port_));
  add("--token-file", absolute(token_file_));
  add("--certificate", absolute(certificate_));
  add("--key", absolute(key_));
  for (const std::string& host : hosts_) add("--host", host);
  return words;
}

void ServingOptions::apply_to(ConsoleConfig& config) const {
  ServerOptions& server = config.server;
  if (!listen_.empty()) server.address = listen_;
  if (port_ >= 0) server.port = static_cast<std::uint16_t>(port_);
  if (!token_file_.empty()) config.token_file = token_file_;
  if (!certificate_.empty()) server.certificate = certificate_;
  if (!key_.empty()) server.key = key_;
  server.hosts.insert(server.hosts.end(), hosts_.begin(), hosts_.end());
}

ServerOptions serving(const ConsoleConfig& config) {
  ServerOptions server = config.server;
  if (server.certificate.empty() != server.key.empty()) {
    throw InputError("console: a certificate and its key are given together, or neither");
  }
  if (!config.token_file.empty()) server.token = read_token(config.token_file);
  server.files = {{"/", page_directory()},
                  {"/lib/three/", library("three")},
                  {"/lib/dygraphs/", library("dygraphs")}};
  return server;
}

AddressFile::AddressFile(const fs::path& run, const std::string& url)
    : file_(address_file(run)),
      fd_(open(file_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
  const std::string line = url + "\n";
  // Held until the process ends, however it ends.
  if (fd_ < 0 || flock(fd_, LOCK_EX | LOCK_NB) != 0 || write(fd_, line.data(), line.size()) < 0) {
    throw InputError(file_.string() + ": " + std::strerror(errno));
  }
}

AddressFile::~AddressFile() {
  std::error_code ignored;
  fs::remove(file_, ignored);
  close(fd_);
}

std::optional<std::string> console_address(const fs::path& run) {
  const int fd = open(address_file(run).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return std::nullopt;
  const bool held = flock(fd, LOCK_SH | LOCK_NB) != 0;  // else by one that was killed
  close(fd);
  if (!held) return std::nullopt;
  const std::string text = read_file(address_file(run));
  const auto end = text.find('\n');
  if (end == std::string::npos) return std::nullopt;
  return text.substr(0, end);
}

}  // namespace berth::console
