// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/console/server/server.h"

namespace CLI {
class App;
}

namespace berth::console {

/// config/console.yaml.
struct ConsoleConfig {
  bool start = true;  ///< with berth up and berth run
  bool hold_on_loss = true;
  ServerOptions server;              ///< without its token, files and mode
  std::filesystem::path token_file;  ///< empty: no token
};

/// Of a configuration directory; as shipped where it has no console.yaml. @throws InputError
ConsoleConfig load_console_config(const std::filesystem::path& directory);

/// Options that override the configuration.
class ServingOptions {
 public:
  void add_to(CLI::App& command);
  /// Whether any option was given.
  bool given() const;
  /// The same again, for another program's command line.
  std::vector<std::string> arguments() const;
  void apply_to(ConsoleConfig& config) const;

 private:
  std::string listen_;
  int port_ = -1;
  std::filesystem::path token_file_;
  std::filesystem::path certificate_;
  std::filesystem::path key_;
  std::vector<std::string> hosts_;
};

/// Everything a server needs: the configuration with its token read, the page and the libraries
/// that Debian's packages libjs-three and libjs-dygraphs install. @throws InputError
ServerOptions serving(const ConsoleConfig& config);

/// The file to which the console of a run writes its address, and which it locks, as long as it
/// serves.
class AddressFile {
 public:
  AddressFile(const std::filesystem::path& run, const std::string& url);
  ~AddressFile();
  AddressFile(const AddressFile&) = delete;
  AddressFile& operator=(const AddressFile&) = delete;

 private:
  std::filesystem::path file_;
  int fd_;
};

/// Where the console that was started with a run serves; nothing when there is none.
std::optional<std::string> console_address(const std::filesystem::path& run);

}  // namespace berth::console
