// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/yaml.h"

#include <sys/stat.h>

#include "common/core/config.h"
#include "common/core/file.h"
#include "common/core/yaml_text.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;

namespace {

std::string yaml_error(const std::string& text) {
  try {
    read_yaml(text, "p.yaml");
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

std::string times(int n, const std::string& text) {
  std::string all;
  for (int i = 0; i < n; ++i) all += text;
  return all;
}

YamlNode text_list(const std::vector<std::string>& texts) {
  YamlNode list(YamlNode::Kind::list);
  for (const std::string& text : texts) list.add(YamlNode(text));
  return list;
}

}  // namespace

TEST_CASE("a file is one document: what would not be read is refused by its line") {
  CHECK(yaml_error("name: a\nsteps: []\n---\ncriteria: []\n")
            .find("p.yaml:3: found a second document") == 0);
  CHECK(yaml_error("name: a\n...\ncriteria: []\n").find("p.yaml:3: found a second") == 0);
  CHECK(yaml_error("name: a\n---\n").find("p.yaml:2: found a second") == 0);
  CHECK(yaml_error("{name: a}\ncriteria: []\n").find("p.yaml:2: found a second") == 0);
  CHECK(yaml_error("# mine\n---\nname: a\n...\n# the end\n").empty());
  CHECK(yaml_error("%YAML 1.2\n---\nname: a\n").empty());
}

TEST_CASE("an anchor that holds its own alias is refused") {
  CHECK(yaml_error("steps: &all\n  - repeat: {times: 2, steps: *all}\n")
            .find("p.yaml:2: found an alias of the value that it stands in") == 0);
  CHECK(yaml_error("&a [b, *a]\n").find("p.yaml:1: found an alias") == 0);
  CHECK(yaml_error("&a {b: {c: *a}}\n").find("p.yaml:1: found an alias") == 0);
  CHECK(yaml_error("a: *nowhere\n").find("p.yaml:1: not YAML") == 0);
}

TEST_CASE("aliases that stand for too much are refused at the line where it becomes too much") {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 13; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before +
            times(9, ", " + before) + "]\n";
  }
  CHECK(yaml_error(text).find("p.yaml:5: found more than 100000 values") == 0);
  std::string deep = "a0: &a0 [" + times(30, "[") + times(30, "]") + "]\n";
  for (int i = 1; i < 6; ++i) {
    deep += "a" + std::to_string(i) + ": &a" + std::to_string(i) + times(1, " [*a") +
            std::to_string(i - 1) + "]\n";
  }
  CHECK(yaml_error(deep).empty());
  CHECK(yaml_error(deep + "b: " + times(70, "[") + "*a0" + times(70, "]") + "\n")
            .find("p.yaml:7: found more than 100 levels") == 0);
}

TEST_CASE("depth has an end, however it is written") {
  for (const char* open : {"[", "{a: ", "- ", "? ", "[[],", "a:\n", "[{"}) {
    INFO(open);
    CHECK_FALSE(yaml_error(times(20000, open)).empty());
  }
  std::string indented;
  for (int i = 0; i < 150; ++i) indented += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  CHECK(yaml_error(indented).find("p.yaml:101: found more than 100 levels") == 0);
}

TEST_CASE("an alias is the value that it stands for, and a merge what the map has not itself") {
  const YamlNode root = read_yaml(
      "base: &base {speed: 1 m/s, turn: 2 deg/s}\nother: &other {turn: 9 deg/s, frozen: none}\n"
      "same: *base\nfast:\n  <<: *base\n  speed: 3 m/s\nboth: {<<: [*base, *other]}\n\"<<\": "
      "text\n",
      "p.yaml");
  CHECK(root.at("same") == root.at("base"));
  CHECK(root.at("fast").at("speed").text() == "3 m/s");
  CHECK(root.at("fast").at("turn").text() == "2 deg/s");
  CHECK(root.at("both").at("turn").text() == "2 deg/s");
  CHECK(root.at("both").at("frozen").text() == "none");
  CHECK(root.at("<<").text() == "text");
  CHECK(yaml_error("a: 1\nb: {<<: 3}\n").find("p.yaml:2: key '<<': found '3'") == 0);
  CHECK(yaml_error("a: {<<: {b: 1}, <<: {c: 1}}\n").find("'<<' appears twice") !=
        std::string::npos);
}

TEST_CASE("tags, keys that are no words and keys that appear twice are refused by line") {
  CHECK(yaml_error("a: 1\nb: !!int 010\n") ==
        "p.yaml:2: found the tag '!!int', expected a value without a tag");
  CHECK(yaml_error("a: !mine {b: 1}\n").find("p.yaml:1: found the tag '!mine'") == 0);
  CHECK(yaml_error("a: !<tag:x> [1]\n").find("p.yaml:1: found the tag 'tag:x'") == 0);
  CHECK(yaml_error("a: 1\n? [b]\n: 2\n").find("p.yaml:2: found a list or map as a key") == 0);
  CHECK(yaml_error("a: 1\n: 2\n").find("p.yaml:2: found nothing as a key") == 0);
  CHECK(yaml_error("a:\n  b: 1\n  \"b\": 2\n") == "p.yaml:3: key 'b' appears twice");
}

TEST_CASE("a byte order mark and the line ends of other systems are no part of a file's text") {
  const YamlNode unix = read_yaml("a: 1\nb: |\n  x\n  y\nc: 3\n", "p.yaml");
  CHECK(read_yaml("\xEF\xBB\xBF"
                  "a: 1\nb: |\n  x\n  y\nc: 3\n",
                  "p.yaml") == unix);
  CHECK(read_yaml("a: 1\r\nb: |\r\n  x\r\n  y\r\nc: 3\r\n", "p.yaml") == unix);
  const YamlNode mac = read_yaml("a: 1\rb: |\r  x\r  y\rc: 3\r", "p.yaml");
  CHECK(mac == unix);
  CHECK(mac.at("c").line() == 5);
}

TEST_CASE("bytes that are no text are refused by line") {
  const std::string nul(1, '\0');
  CHECK(yaml_error("a: 1\nb: x" + nul + "y\n").find("p.yaml:2: found the character U+0000") == 0);
  CHECK(yaml_error("a: 1\nb: \x04\nc: 2\n").find("p.yaml:2: found the character U+0004") == 0);
  CHECK(yaml_error("a: 1\nb: \"x\\0y\"\n").find("p.yaml:2: found the character U+0000") == 0);
  CHECK(yaml_error("a: \"\\x1B[2J\"\n").find("p.yaml:1: found the character U+001B") == 0);
  CHECK(yaml_error("a: 1\nb: \xEF\xBB\xBF"
                   "2\n")
            .find("p.yaml:2: found the character U+FEFF") == 0);
  CHECK(yaml_error("a: 1 # H\xF6he\n").find("p.yaml:1: found bytes that are not UTF-8") == 0);
  CHECK(yaml_error("a: \xC0\xAF\n").find("not UTF-8") != std::string::npos);
  CHECK(yaml_error("a: \xED\xA0\x80\n").find("not UTF-8") != std::string::npos);
  CHECK(yaml_error("a: \xF4\x90\x80\x80\n").find("not UTF-8") != std::string::npos);
  CHECK(yaml_error("\xFF\xFE"
                   "a" +
                   nul + ":" + nul)
            .find("p.yaml:1: found UTF-16") == 0);
  CHECK(read_yaml("a: H\xC3\xB6he \xF0\x9F\x9B\xB0\n", "").at("a").text() ==
        "H\xC3\xB6he \xF0\x9F\x9B\xB0");
}

TEST_CASE("a path that is no file with keys is refused with what it is") {
  const TemporaryDirectory directory;
  const auto error_of = [](const std::filesystem::path& path) -> std::string {
    try {
      Config::load(path);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  CHECK(error_of(directory.path()).find("is a directory, expected a file") != std::string::npos);
  const auto pipe = directory / "pipe.yaml";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(error_of(pipe).find("is no regular file, expected a file") != std::string::npos);
  write_file(directory / "empty.yaml", "");
  CHECK(error_of(directory / "empty.yaml").find("empty.yaml:1: found nothing, expected a map") !=
        std::string::npos);
  write_file(directory / "text.yaml", "\nonly words\n");
  CHECK(error_of(directory / "text.yaml").find("text.yaml:2: found 'only words', expected a map") !=
        std::string::npos);
}

TEST_CASE("a value is written so that it reads as itself") {
  const YamlNode list =
      text_list({"3 m", "a, b", "a: b", "x #y",      "it's",        "",       "null", "~",
                 "- a", "[",    "*a",   "&a",        "!t",          "\"q\"",  "a\nb", " a ",
                 "<<",  "\\",   "%",    "tab\there", "H\xC3\xB6he", "-30 mm", "${x}", "{}"});
  CHECK(read_yaml(flow_text(list), "") == list);
  YamlNode map(YamlNode::Kind::map);
  for (const YamlNode& item : list.items()) map.put(item.text(), item);
  YamlNode inner(YamlNode::Kind::map);
  inner.put("list", list);
  inner.put("none", YamlNode());
  inner.put("empty", YamlNode(YamlNode::Kind::map));
  YamlNode maps(YamlNode::Kind::list);
  maps.add(map);
  maps.add(inner);
  YamlNode file(YamlNode::Kind::map);
  file.put("maps", maps);
  file.put("inner", inner);
  CHECK(read_yaml(written(file), "") == file);
  CHECK(flow_text(text_list({"3 m", "-30 mm", "1.0"})) == "[3 m, -30 mm, 1.0]");
}

TEST_CASE("a value is replaced where it stands, or not at all") {
  const auto with_b = [](const std::string& text, const YamlNode& value) {
    YamlNode expected = read_yaml(text, "");
    const auto span = span_of(text, expected.at("b"));
    expected.put("b", value);
    return span ? edited(text, {{*span, value}}, expected).value_or("none") : "none";
  };
  const YamlNode hard("it's: #1, \"x\"");
  CHECK(with_b("a: 1  # one\nb: 2  # two\n", YamlNode("3 m")) == "a: 1  # one\nb: 3 m  # two\n");
  CHECK(with_b("b: 'x'\n", YamlNode("y")) == "b: 'y'\n");
  CHECK(with_b("{b: 2, c: 3}\n", hard) == "{b: \"it's: #1, \\\"x\\\"\", c: 3}\n");
  CHECK(with_b("b: [1, ']', # here ]\n  2]\nc: 3\n", text_list({"5"})).find("c: 3") !=
        std::string::npos);
  CHECK(with_b("b: |\n  one\n  two\n\nc: 3\n", YamlNode("x")) == "b: x\n\nc: 3\n");
  CHECK(with_b("b: one\n  two\nc: 3\n", YamlNode("x")) == "b: x\nc: 3\n");
  CHECK(with_b("a: &x 1\nb: *x\n", YamlNode("2")) == "none");
  CHECK(with_b("b:\n  - 1\n", text_list({"2"})) == "none");
  const std::string commented = "b: 'it''s'   # of the approach \nc: 2\n";
  CHECK(comment_behind(commented, read_yaml(commented, "").at("b")) == "of the approach");
  CHECK(comment_behind(commented, read_yaml(commented, "").at("c")).empty());
}
