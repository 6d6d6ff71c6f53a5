// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/board.h"

#include <nlohmann/json.hpp>

#include "test/catch.h"

using berth::console::Board;
using berth::console::BoardMessage;
using nlohmann::json;

namespace {

json parsed(const BoardMessage& message) {
  REQUIRE(message.text != nullptr);
  return json::parse(*message.text);
}

/// A page: it sees the board only through messages.
struct Page {
  std::uint64_t revision = 0;
  json sections = json::object();
  std::map<std::string, std::vector<json>> lists;

  void take(const BoardMessage& message) {
    revision = message.revision;
    if (message.text == nullptr) return;
    const json text = json::parse(*message.text);
    CHECK(text["type"] == "board");
    CHECK(text["revision"] == message.revision);
    for (const auto& name : text.value("reset", json::array())) lists[name].clear();
    sections.update(text.value("set", json::object()));
    const json added = text.value("add", json::object());
    for (const auto& [name, entries] : added.items()) {
      lists[name].insert(lists[name].end(), entries.begin(), entries.end());
    }
  }
};

}  // namespace

TEST_CASE("a viewer receives the entries newer than its own, and nothing else") {
  Board board;
  CHECK(board.message_since(0).text == nullptr);
  board.at(1234567);
  CHECK(board.message_since(0).text == nullptr);
  board.set("arms", R"({"replica":1})");
  board.set("safe", R"("held")");
  const BoardMessage all = board.message_since(0);
  CHECK(parsed(all)["utime"] == 1234567);
  CHECK(json::parse(board.time_alone()) ==
        json({{"type", "board"}, {"revision", all.revision}, {"utime", 1234567}}));
  CHECK(parsed(all)["set"] == json({{"arms", {{"replica", 1}}}, {"safe", "held"}}));

  CHECK(board.message_since(all.revision).text == nullptr);
  board.set("safe", R"("held")");  // as it was
  CHECK(board.message_since(all.revision).text == nullptr);
  board.set("safe", R"("moving")");
  const json change = parsed(board.message_since(all.revision));
  CHECK(change["set"] == json({{"safe", "moving"}}));
  CHECK_FALSE(change.contains("reset"));
}

TEST_CASE("lists keep their newest entries and are emptied on every page") {
  Board board;
  board.keep("events", 3);
  Page early;
  for (int i = 0; i < 5; ++i) {
    board.add("events", std::to_string(i));
    early.take(board.message_since(early.revision));
  }
  CHECK(early.lists["events"] == std::vector<json>{0, 1, 2, 3, 4});
  Page late;
  late.take(board.message_since(0));
  CHECK(late.lists["events"] == std::vector<json>{2, 3, 4});

  board.reset("events");
  late.take(board.message_since(late.revision));
  CHECK(late.lists["events"].empty());
  board.add("events", "5");
  early.take(board.message_since(early.revision));
  CHECK(early.lists["events"] == std::vector<json>{5});
  early.take(board.message_since(0));  // it joins again
  CHECK(early.lists["events"] == std::vector<json>{5});
}

TEST_CASE("a slow viewer comes to the same content by fewer messages") {
  Board board;
  Page quick;
  Page slow;
  int messages = 0;
  for (int i = 0; i < 100; ++i) {
    board.set("frames", std::to_string(i));
    if (i % 10 == 0) board.set("run", '"' + std::to_string(i) + '"');
    board.add("samples", std::to_string(i));
    quick.take(board.message_since(quick.revision));
    if (i % 33 == 0) {
      slow.take(board.message_since(slow.revision));
      ++messages;
    }
  }
  CHECK(messages == 4);
  CHECK(slow.sections == quick.sections);
  CHECK(slow.lists == quick.lists);
}

TEST_CASE("viewers at one revision share one text") {
  Board board;
  board.set("run", "1");
  const std::uint64_t first = board.revision();
  board.set("arms", "2");
  const auto messages = board.messages_since({0, first, 0, first, board.revision()});
  CHECK(messages[0].text == messages[2].text);
  CHECK(messages[1].text == messages[3].text);
  CHECK(messages[0].text != messages[1].text);
  CHECK(messages[4].text == nullptr);
  CHECK(messages[0].revision == board.revision());
  CHECK(messages[1].revision == board.revision());
}
