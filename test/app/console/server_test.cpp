// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/server.h"

#include <poll.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>
#include <vector>

#include "app/console/server/credentials.h"
#include "common/core/error.h"
#include "test/app/console/web_client.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::console;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

/// A server of a small page and a library, on a port of its own.
struct Rig {
  TemporaryDirectory files;
  Board board;
  ServerOptions options;
  std::unique_ptr<Server> server;
  std::vector<Incoming> seen;

  Rig() {
    std::filesystem::create_directories(files / "page");
    std::filesystem::create_directories(files / "library");
    std::ofstream(files / "page/index.html") << "<p>the page</p>";
    std::ofstream(files / "page/.secret") << "hidden";
    std::ofstream(files / "secret") << "outside";
    std::ofstream(files / "library/real.js") << "export {};";
    std::filesystem::create_symlink("real.js", files / "library/three.js");
    options.port = 0;
    options.frames_per_s = 200;
    options.files = {{"/", files / "page"}, {"/lib/three/", files / "library"}};
  }

  std::uint16_t start() {
    server = std::make_unique<Server>(options, board);
    return server->port();
  }
  std::uint16_t port() { return server ? server->port() : start(); }

  /// Waits until something of this kind came in, and gives it.
  Incoming next(Incoming::Kind kind) {
    for (;;) {
      const auto found = std::find_if(seen.begin(), seen.end(),
                                      [kind](const Incoming& one) { return one.kind == kind; });
      if (found != seen.end()) {
        Incoming one = *found;
        seen.erase(found);
        return one;
      }
      pollfd ready{server->descriptor(), POLLIN, 0};
      REQUIRE(poll(&ready, 1, 20000) == 1);
      for (Incoming& one : server->take()) seen.push_back(std::move(one));
    }
  }
  /// Waits until so many were turned away; the answer may come before the count.
  bool refused(std::int64_t times) const {
    while (server->counters().refused < times) std::this_thread::yield();
    return server->counters().refused == times;
  }
  std::string refusal() { return next(Incoming::Kind::refused).code; }
};

/// A viewer that behaves; it has read its hello.
struct Viewer : WebClient {
  std::string name;

  explicit Viewer(std::uint16_t port) : WebClient(port) {
    REQUIRE(upgrade() == 101);
    const json hello = json::parse(frame().text);
    CHECK(hello["type"] == "hello");
    name = hello["viewer"];
  }
  /// The next message of this type.
  json message(const std::string& type) {
    for (;;) {
      const WebFrame one = frame();
      REQUIRE(one.opcode == 1);
      json text = json::parse(one.text);
      if (text["type"] == type) return text;
    }
  }
  /// Reads on until a section has the value given. @return how many messages that took
  int read_until(const std::string& section, const json& value) {
    for (int messages = 1;; ++messages) {
      const json text = message("board");
      if (text.value("set", json::object()).value(section, json()) == value) return messages;
    }
  }
};

}  // namespace

TEST_CASE("the page, Debian's libraries and made contents are served") {
  Rig rig;
  rig.start();
  rig.server->offer("/mesh/replica", "model/stl", "solid");
  WebClient client(rig.port());
  const WebResponse page = client.get("/");
  CHECK(page.status == 200);
  CHECK(page.body == "<p>the page</p>");
  CHECK(page.fields.at("content-type") == "text/html; charset=utf-8");
  CHECK(page.fields.at("x-content-type-options") == "nosniff");
  CHECK_THAT(page.fields.at("content-security-policy"),
             Contains("default-src 'none'") && Contains("frame-ancestors 'none'"));
  // One connection serves them all.
  const WebResponse library = client.get("/lib/three/three.js?v=1");
  CHECK(library.body == "export {};");
  CHECK(library.fields.at("content-type") == "text/javascript; charset=utf-8");
  CHECK(client.get("/mesh/replica").body == "solid");
  CHECK(client.get("/", "If-None-Match: " + page.fields.at("etag") + "\r\n").status == 304);
  client.send("HEAD / HTTP/1.1\r\nHost: 127.0.0.1:1\r\n\r\n");
  const WebResponse head = client.response(true);
  CHECK(head.status == 200);
  CHECK(head.fields.at("content-length") == "15");
  CHECK(client.get("/nothing").status == 404);
  CHECK(client.get("/live").status == 426);
  CHECK(rig.server->counters().refused == 0);
}

TEST_CASE("requests that no page sends are refused and reported, and disturb no other viewer") {
  Rig rig;
  Viewer viewer(rig.port());
  struct Case {
    std::string request;
    int status;
    std::string code;
  };
  const std::string host = "Host: localhost\r\n";
  const std::string socket =
      "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  const std::vector<Case> cases{
      {"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", 421, "host"},
      {"GET / HTTP/1.1\r\n\r\n", 421, "host"},
      {"GET /live HTTP/1.1\r\n" + host + socket + "Origin: http://evil.example\r\n\r\n", 403,
       "origin"},
      {"GET /live HTTP/1.1\r\n" + host + socket + "Origin: null\r\n\r\n", 403, "origin"},
      {"GET /live HTTP/1.1\r\n" + host + socket + "Origin: http://localhost:1\r\n\r\n", 403,
       "origin"},
      {"GET / HTTP/1.1\r\n" + host + socket + "\r\n", 404, "path"},
      {"DELETE / HTTP/1.1\r\n" + host + "\r\n", 405, "method"},
      {"POST / HTTP/1.1\r\n" + host + "Content-Length: 5\r\n\r\nhello", 413, "body"},
      {"GET /../secret HTTP/1.1\r\n" + host + "\r\n", 400, "path"},
      {"GET /%2e%2e/secret HTTP/1.1\r\n" + host + "\r\n", 400, "path"},
      {"GET /.secret HTTP/1.1\r\n" + host + "\r\n", 400, "path"},
      {"GET /lib/three/..\\secret HTTP/1.1\r\n" + host + "\r\n", 400, "path"},
      {"GET //etc/passwd HTTP/1.1\r\n" + host + "\r\n", 400, "path"},
      {"GET http://evil.example/ HTTP/1.1\r\n" + host + "\r\n", 400, "path"},
      {"\x16\x03\x01 this is TLS\r\n\r\n", 400, "request"},
      {"GET / HTTP/1.1\r\n" + host + "X: " + std::string(20000, 'x') + "\r\n\r\n", 431, "header"},
  };
  std::int64_t refused = 0;
  for (const Case& one : cases) {
    CAPTURE(one.request.substr(0, 100));
    WebClient client(rig.port());
    client.send(one.request);
    CHECK(client.response().status == one.status);
    CHECK(client.ends());
    CHECK(rig.refused(++refused));
  }
  rig.board.set("safe", "\"safe\"");
  viewer.read_until("safe", "safe");
  CHECK(WebClient(rig.port()).get("/").status == 200);
  std::set<std::string> untold{"host", "origin", "path", "method", "body", "request", "header"};
  while (!untold.empty()) untold.erase(rig.refusal());
}

TEST_CASE("with a token only its bearer is served") {
  Rig rig;
  rig.options.token = std::string(40, 'k');
  const std::string right = "Authorization: Bearer " + rig.options.token + "\r\n";
  const auto port = rig.start();
  CHECK(WebClient(port).get("/").status == 401);
  CHECK(rig.refusal() == "token-missing");
  CHECK(WebClient(port).get("/?token=wrong").status == 401);
  CHECK(rig.refusal() == "token-wrong");
  CHECK(WebClient(port).get("/", "Authorization: Bearer " + std::string(39, 'k') + "\r\n").status ==
        401);
  CHECK(WebClient(port).get("/lib/three/three.js").status == 401);
  CHECK(WebClient(port).upgrade() == 401);
  CHECK(WebClient(port).get("/", right).status == 200);
  CHECK(WebClient(port).upgrade(right) == 101);
  // A browser: the address once, from then on its cookie.
  const WebResponse first = WebClient(port).get("/?token=" + rig.options.token);
  CHECK(first.status == 303);
  CHECK(first.fields.at("location") == "./");
  const std::string cookie = first.fields.at("set-cookie");
  CHECK_THAT(cookie, Contains("HttpOnly") && Contains("SameSite=Strict"));
  const std::string back = "Cookie: other=1; " + cookie.substr(0, cookie.find(';')) + "\r\n";
  CHECK(WebClient(port).get("/", back).status == 200);
  CHECK(WebClient(port).upgrade(back) == 101);
}

TEST_CASE("two consoles that have one port at two addresses each report their own address") {
  Rig one;
  Rig other;
  other.options.address = "127.0.0.2";
  const auto port = one.start();
  other.options.port = port;
  other.start();
  CHECK(one.server->url() == "http://127.0.0.1:" + std::to_string(port) + "/");
  CHECK(other.server->url() == "http://127.0.0.2:" + std::to_string(port) + "/");
  Rig third;  // at an address that is taken: the next port, which is reported
  third.options.port = port;
  third.options.ports_to_try = 200;
  CHECK(third.start() != port);
  CHECK_THAT(third.server->url(), Contains(":" + std::to_string(third.port()) + "/"));
}

TEST_CASE("behind a proxy that speaks TLS the page's own connection is taken, another's is not") {
  Rig rig;
  const std::string origin = "Origin: https://";
  CHECK(WebClient(rig.port()).upgrade(origin + "localhost\r\n") == 101);
  CHECK(WebClient(rig.port()).upgrade(origin + "evil.example\r\n") == 403);
}

TEST_CASE("another host needs token and TLS; the certificate made for it is believed") {
  Rig rig;
  const Credentials made = make_credentials(rig.files / "credentials", {"localhost", "10.1.2.3"});
  CHECK_THROWS_AS(make_credentials(rig.files / "credentials", {"localhost"}), InputError);
  rig.options.address = "0.0.0.0";
  CHECK_THROWS_AS(rig.start(), InputError);
  rig.options.token = read_token(made.token);
  CHECK(rig.options.token.size() == 64);
  CHECK_THROWS_AS(rig.start(), InputError);
  rig.options.certificate = made.certificate;
  rig.options.key = made.key;
  const auto port = rig.start();
  CHECK_THAT(rig.server->url(), Contains("https://"));
  const std::string right = "Authorization: Bearer " + rig.options.token + "\r\n";
  {
    WebClient client(port, made.certificate.string());
    CHECK(client.get("/").status == 401);
  }
  WebClient viewer(port, made.certificate.string());
  CHECK(viewer.upgrade(right + "Origin: https://localhost\r\n") == 101);
  CHECK_THAT(viewer.frame().text, Contains("hello"));
  WebClient plain(port);
  CHECK(plain.get("/").status == 0);
  for (std::string code = rig.refusal(); code != "tls"; code = rig.refusal()) {
  }

  std::filesystem::permissions(made.token, std::filesystem::perms::group_read,
                               std::filesystem::perm_options::add);
  CHECK_THROWS_AS(read_token(made.token), InputError);
  std::ofstream(rig.files / "short") << "too short\n";
  std::filesystem::permissions(rig.files / "short", std::filesystem::perms::owner_read);
  CHECK_THROWS_AS(read_token(rig.files / "short"), InputError);
}

TEST_CASE("viewers receive the changes; a late one receives everything") {
  Rig rig;
  rig.board.set("run", R"({"name":"drill"})");
  Viewer early(rig.port());
  CHECK(rig.next(Incoming::Kind::joined).viewer == early.name);
  CHECK(early.message("board")["set"]["run"]["name"] == "drill");
  rig.board.set("safe", "\"moving\"");
  CHECK(early.message("board")["set"] == json({{"safe", "moving"}}));
  Viewer late(rig.port());
  CHECK(late.name != early.name);
  CHECK(late.message("board")["set"].size() == 2);
  CHECK(late.message("board").contains("utime"));  // where nothing changes, a sign of life
  CHECK(rig.server->counters().viewers == 2);
}

TEST_CASE("a slow viewer gets fewer frames, the newest ones, and delays no other") {
  Rig rig;
  rig.options.frames_per_s = 1000;
  WebClient::receive_buffer_bytes = 4096;
  Viewer slow(rig.port());
  WebClient::receive_buffer_bytes = 0;
  Viewer quick(rig.port());
  const std::string bulk(200000, 'x');
  constexpr int frames = 60;
  for (int i = 1; i <= frames; ++i) {
    rig.board.set("frames", json{{"number", i}, {"bulk", bulk}}.dump());
    while (quick.message("board").value("set", json::object())["frames"]["number"] != i) {
    }
  }
  CHECK(rig.server->counters().late_frames > 0);
  int messages = 0;
  json last;
  do {
    last = slow.message("board").value("set", json::object());
    messages += last.contains("frames") ? 1 : 0;
  } while (!last.contains("frames") || last["frames"]["number"] != frames);
  CHECK(messages < frames / 2);
}

TEST_CASE("commands reach the node, answers their viewer") {
  Rig rig;
  Viewer other(rig.port());
  {
    Viewer viewer(rig.port());
    viewer.send_frame(
        R"({"type":"command","id":7,"command":"skip","arguments":{"reason":"dull"}})");
    const Incoming one = rig.next(Incoming::Kind::command);
    CHECK(one.viewer == viewer.name);
    CHECK(one.command.viewer == viewer.name);
    CHECK(one.command.id == 7);
    CHECK(one.command.name == "skip");
    CHECK(one.command.arguments == json{{"reason", "dull"}});
    CHECK(one.command.confirm.empty());
    rig.server->answer(viewer.name, {7, false, "nobody \"holds\" the control", "yes"});
    const json answer = viewer.message("answer");
    CHECK(answer == json{{"type", "answer"},
                         {"id", 7},
                         {"accepted", false},
                         {"text", "nobody \"holds\" the control"},
                         {"confirm", "yes"}});
  }
  CHECK(rig.next(Incoming::Kind::left).viewer != other.name);
  rig.server->answer("viewer-99", {1, true, "", ""});

  rig.options.may_command = false;
  rig.start();
  Viewer watcher(rig.port());
  watcher.send_frame(R"({"type":"command","id":1,"command":"hold"})");
  CHECK(watcher.message("answer")["accepted"] == false);
}

TEST_CASE("malformed frames end their viewer's connection, with the code of the reason") {
  Rig rig;
  Viewer bystander(rig.port());
  struct Case {
    std::string text;
    int opcode;
    bool masked;
    int code;
  };
  const std::vector<Case> cases{
      {std::string(largest_command + 1, ' '), 1, true, 1009},
      {"{}", 1, false, 1002},       // unmasked
      {"{}", 3, true, 1002},        // an opcode that is none
      {"{}", 2, true, 1003},        // binary
      {"\xff\xfe", 1, true, 1007},  // no UTF-8
      {"{\"type\":", 1, true, 1007},
      {R"({"type":"command","id":"7","command":"hold"})", 1, true, 1007},
  };
  std::int64_t refused = 0;
  for (const Case& one : cases) {
    CAPTURE(one.code, one.text.substr(0, 60));
    Viewer viewer(rig.port());
    viewer.send_frame(one.text, one.opcode, one.masked);
    WebFrame farewell = viewer.frame();
    while (farewell.opcode == 1) farewell = viewer.frame();
    CHECK(farewell.opcode == 8);
    CHECK(farewell.close_code == one.code);
    viewer.send_frame("", 8);
    CHECK(viewer.ends());
    CHECK(rig.refused(++refused));
  }
  Viewer flood(rig.port());
  for (int i = 0; i < 1000; ++i) {
    flood.send_frame(R"({"type":"command","id":1,"command":"hold"})");
  }
  WebFrame farewell = flood.frame();
  while (farewell.opcode == 1) farewell = flood.frame();
  CHECK(farewell.close_code == 1008);
  rig.board.set("safe", "\"safe\"");
  bystander.read_until("safe", "safe");
}

TEST_CASE("slow clients and hoarders of connections are disconnected, and viewers are limited") {
  Rig rig;
  rig.options.request_time = std::chrono::milliseconds(150);
  rig.options.max_connections = 4;
  rig.options.max_viewers = 2;
  Viewer one(rig.port());
  Viewer two(rig.port());
  CHECK(WebClient(rig.port()).upgrade() == 503);
  CHECK(rig.refusal() == "viewers");
  {
    WebClient slow(rig.port());
    slow.send("GET / HTTP/1.1\r\nHost: loc");
    WebClient silent(rig.port());
    WebClient beyond(rig.port());
    CHECK(beyond.ends());
    CHECK(rig.refusal() == "connections");
    CHECK(slow.ends());
    CHECK(silent.ends());
    CHECK(rig.refusal() == "slow");
  }
  rig.board.set("safe", "\"safe\"");
  one.read_until("safe", "safe");
  two.read_until("safe", "safe");
  CHECK(WebClient(rig.port()).get("/").status == 200);
}

TEST_CASE("ports that are taken are passed over, and viewers are notified when the console ends") {
  Rig rig;
  Viewer viewer(rig.port());
  ServerOptions same_port = rig.options;
  same_port.port = rig.server->port();
  CHECK_THROWS_AS(Server(same_port, rig.board), InputError);
  same_port.ports_to_try = 50;
  CHECK(Server(same_port, rig.board).port() != rig.server->port());
  rig.server.reset();
  WebFrame farewell = viewer.frame();
  while (farewell.opcode == 1) farewell = viewer.frame();
  CHECK(farewell.close_code == 1001);
}

TEST_CASE("a command is one flat object of known keys") {
  const Command command =
      parse_command(R"({"type":"command","id":-3,"command":"seek","arguments":{"position_s":1.5},)"
                    R"("confirm":"go"})");
  CHECK(command.id == -3);
  CHECK(command.arguments["position_s"] == 1.5);
  CHECK(command.confirm == "go");
  for (const char* bad : {
           "",
           "[]",
           "null",
           "{}",
           "{\"type\":\"command\"}",
           R"({"type":"board","id":1,"command":"hold"})",
           R"({"type":"command","id":1.5,"command":"hold"})",
           R"({"type":"command","id":1,"command":"Hold!"})",
           R"({"type":"command","id":1,"command":"hold","arguments":[]})",
           R"({"type":"command","id":1,"command":"hold","more":1})",
           R"({"type":"command","id":1,"command":"hold","arguments":{"a":[[[[[[[1]]]]]]]}})",
           R"({"type":"command","id":99999999999999999999,"command":"hold"})",
       }) {
    CAPTURE(bad);
    CHECK_THROWS_AS(parse_command(bad), InputError);
  }
  CHECK_THROWS_AS(parse_command(std::string(100000, '[')), InputError);
}
