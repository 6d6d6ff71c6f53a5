// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/serving.h"

#include <CLI/CLI.hpp>
#include <fstream>

#include "common/core/error.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::console;
using Catch::Matchers::Contains;

namespace {

ConsoleConfig config_of(const std::string& text) {
  const TemporaryDirectory directory;
  std::ofstream(directory / "console.yaml") << text;
  return load_console_config(directory.path());
}

}  // namespace

TEST_CASE("the console that ships is for its own host, and needs no configuration") {
  const ConsoleConfig shipped = load_console_config("config");
  const ConsoleConfig none = load_console_config("test");
  for (const ConsoleConfig& config : {shipped, none}) {
    CHECK(config.start);
    CHECK(config.hold_on_loss);
    CHECK(config.server.address == "127.0.0.1");
    CHECK(config.server.port == 8800);
    CHECK(config.server.frames_per_s == 20);
    CHECK(config.token_file.empty());
  }
}

TEST_CASE("a console's configuration is read strictly") {
  CHECK_FALSE(config_of("on_loss_of_control: nothing").hold_on_loss);
  CHECK(config_of("rate: 5 Hz").server.frames_per_s == 5);
  CHECK(config_of("hosts: [cell, cell.lab]").server.hosts.size() == 2);
  for (const char* bad : {"port: 70000", "rate: 0 Hz", "rate: 5", "viewers: 0", "prot: 1",
                          "on_loss_of_control: stop"}) {
    CAPTURE(bad);
    CHECK_THROWS_WITH(config_of(bad), Contains("console.yaml:1"));
  }
}

TEST_CASE("the command line comes before the configuration, and can be handed on") {
  ServingOptions options;
  CLI::App app;
  options.add_to(app);
  app.parse("--port 0 --listen ::1 --host cell --host lab --token-file /t/token", false);
  ConsoleConfig config = config_of("port: 9000\nhosts: [one]\n");
  options.apply_to(config);
  CHECK(config.server.port == 0);
  CHECK(config.server.address == "::1");
  CHECK(config.server.hosts == std::vector<std::string>{"one", "cell", "lab"});
  CHECK(config.token_file == "/t/token");
  CHECK(options.arguments() == std::vector<std::string>{"--listen", "::1", "--port", "0",
                                                        "--token-file", "/t/token", "--host",
                                                        "cell", "--host", "lab"});
  CHECK_FALSE(ServingOptions().given());
  config.server.certificate = "/t/certificate";
  CHECK_THROWS_AS(serving(config), InputError);
}

TEST_CASE("a run's console is known by its address as long as it serves") {
  const TemporaryDirectory run;
  std::filesystem::create_directory(run / "output");
  CHECK_FALSE(console_address(run.path()));
  {
    const AddressFile served(run.path(), "http://localhost:1/");
    CHECK(console_address(run.path()) == "http://localhost:1/");
  }
  CHECK_FALSE(console_address(run.path()));
  std::ofstream(run / "output/console.url") << "http://localhost:2/\n";  // of one that was killed
  CHECK_FALSE(console_address(run.path()));
  const AddressFile next(run.path(), "http://localhost:3/");
  CHECK(console_address(run.path()) == "http://localhost:3/");
}
