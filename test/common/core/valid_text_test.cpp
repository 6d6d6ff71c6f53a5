// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/valid_text.h"

#include <nlohmann/json.hpp>
#include <random>

#include "common/core/table.h"
#include "test/catch.h"

using namespace berth;

namespace {

constexpr char odd[] = "\xEF\xBF\xBD";  // U+FFFD

std::string any_bytes(std::mt19937& random, int length) {
  std::uniform_int_distribution<int> byte(0, 255);
  std::string any;
  for (int i = 0; i < length; ++i) any += static_cast<char>(byte(random));
  return any;
}

bool has_control(const std::string& text, const std::string& but) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool second = c == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    if ((c < 0x20 || c == 0x7F || second) && but.find(text[i]) == std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("text is valid UTF-8, and what was stays as it was", "[text]") {
  CHECK(valid_utf8("plain, 3 \xC2\xB5m, \xE2\x88\x9E \xF0\x9F\x9B\xB0") ==
        "plain, 3 \xC2\xB5m, \xE2\x88\x9E \xF0\x9F\x9B\xB0");
  CHECK(valid_utf8("latin \xE9") == std::string("latin ") + odd);
  CHECK(valid_utf8("cut \xE2\x82") == std::string("cut ") + odd + odd);
  CHECK(valid_utf8("\xC0\xAF") == std::string(odd) + odd);            // an overlong '/'
  CHECK(valid_utf8("\xED\xA0\x80") == std::string(odd) + odd + odd);  // half of a surrogate pair
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    const std::string once = valid_utf8(any_bytes(random, 20));
    CHECK(valid_utf8(once) == once);
    CHECK_NOTHROW(nlohmann::json(once).dump());  // which is strict
  }
}

TEST_CASE("JSON is written whatever its texts are, and drives no terminal", "[text]") {
  std::mt19937 random(5);
  for (int i = 0; i < 500; ++i) {
    const std::string text = any_bytes(random, 20);
    const nlohmann::ordered_json json = {{text, {{"text", text}}}};
    const std::string written = json_text(json, 2);
    CHECK_FALSE(has_control(written, "\n"));
    const auto read = nlohmann::json::parse(written);
    CHECK(read.begin().value()["text"] == read.begin().key());
  }
  CHECK(json_text(nlohmann::json("a\x7F\xC2\x9B"
                                 "1m\xC2\xB5")) == "\"a\\u007f\\u009b1m\xC2\xB5\"");
  CHECK(json_text(nlohmann::json{{"x", std::nan("")}}) == "{\"x\":null}");
}

TEST_CASE("text cannot become markup, and XML can hold it", "[text]") {
  CHECK(markup_text("<a b=\"c\" d='e'>&amp;") ==
        "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp;amp;");
  CHECK(markup_text("two\nlines\tand") == "two&#10;lines&#9;and");
  CHECK(markup_text(std::string("\0\x1b\x7f\xEF\xBF\xBE\xC2\x9B", 8)) ==
        std::string(odd) + odd + odd + odd + odd);
}

TEST_CASE("a CSV field is quoted where it needs to be", "[text]") {
  CHECK(csv_field("plain text") == "plain text");
  CHECK(csv_field("a,b") == "\"a,b\"");
  CHECK(csv_field("say \"so\"") == "\"say \"\"so\"\"\"");
  CHECK(csv_field("two\nlines") == "\"two\nlines\"");
  CHECK(csv_field(" blank") == "\" blank\"");
  CHECK(csv_field(std::string("nul\0\x1b", 5)) == std::string("nul") + odd + odd);
  CHECK(csv_field("latin \xE9") == std::string("latin ") + odd);
}

TEST_CASE("nothing that is printed drives the terminal", "[text]") {
  CHECK(terminal_text("\x1b[2Jgone\n\ttab") == std::string(odd) + "[2Jgone\n\ttab");
  CHECK(terminal_line("one\ntwo\tthree\r\n") == "one two three  ");
  CHECK(terminal_line("\xC2\x9B"
                      "31m") == std::string(odd) + "31m");  // CSI of eight bits
  std::mt19937 random(7);
  for (int i = 0; i < 500; ++i) {
    CHECK_FALSE(has_control(terminal_text(any_bytes(random, 20)), "\n\t"));
    CHECK_FALSE(has_control(text_table({"l", {any_bytes(random, 9), any_bytes(random, 9)}}), "\n"));
  }
}

TEST_CASE("columns of a table are as wide as their characters", "[text]") {
  CHECK(text_table({"l", {"\xC3\xA9t\xC3\xA9", "1"}, {{"name", "22"}}}) ==
        "  \xC3\xA9t\xC3\xA9    1\n  name  22\n");
  CHECK(columns("\xC3\xA9t\xC3\xA9") == 3);
  CHECK(first_columns("\xC3\xA9t\xC3\xA9", 2) == "\xC3\xA9t");
}
