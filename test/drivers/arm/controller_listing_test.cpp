// SPDX-License-Identifier: BSD-3-Clause
// The programs of examples/8_controller against the register map that the driver reads by.
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "common/core/config.h"
#include "common/core/file.h"
#include "drivers/arm/register_map.h"
#include "test/catch.h"

namespace berth {
namespace {

constexpr std::size_t max_comment = 16;  // of a register, on the pendant

/// What the map calls its registers: "R[4]" -> "state".
std::map<std::string, std::string> names_of(const std::string& file) {
  Config config = Config::load(file);
  Config numbers = config.section("numbers");
  std::map<std::string, std::string> names;
  for (const std::string& key : numbers.keys()) {
    names[numbers.text(key)] = key.substr(0, max_comment);
  }
  names[config.text("setpoint")] = "setpoint";
  Config coils = config.section("coils");
  for (const std::string& key : coils.keys()) {
    names["DO[" + std::to_string(coils.small_integer(key)) + "]"] = key;
  }
  return names;
}

struct Listing {
  std::set<std::string> read;
  std::set<std::string> written;
  std::vector<std::string> wrong;  ///< what disagrees with the map, line by line
};

Listing parse(const std::string& text, const std::map<std::string, std::string>& names,
              const RegisterMap& map) {
  static const std::regex line_form(R"(\s*(\d+):(.*);)");
  static const std::regex variable(R"(\b(P?R|DO)\[(\d+)(?::([^\]]*))?\])");
  Listing listing;
  int expected = 0;
  std::istringstream lines(text.substr(text.find("/MN\n") + 4));
  for (std::string line; std::getline(lines, line) && line != "/POS";) {
    std::smatch form;
    const auto wrong = [&](const std::string& why) { listing.wrong.push_back(line + ": " + why); };
    if (!std::regex_match(line, form, line_form) || std::stoi(form[1]) != ++expected) {
      wrong("not line " + std::to_string(expected));
      continue;
    }
    const std::string code = form[2];
    if (code.find('!') == code.find_first_not_of(' ')) continue;  // a remark
    // The first variable before an '=' that no condition holds takes the value.
    const std::size_t action = code.rfind("),") == std::string::npos ? 0 : code.rfind("),") + 2;
    const std::size_t assigned = code.find("=(", action);
    for (auto it = std::sregex_iterator(code.begin(), code.end(), variable);
         it != std::sregex_iterator(); ++it) {
      const std::string kind = (*it)[1];
      const std::string name = kind + "[" + (*it)[2].str() + "]";
      const std::string comment = (*it)[3];
      const auto at = static_cast<std::size_t>(it->position());
      const bool writes = assigned != std::string::npos && at >= action && at < assigned;
      (writes ? listing.written : listing.read).insert(name);
      const auto entry = names.find(name);
      if (entry != names.end() ? comment != entry->second : comment.rfind("spare", 0) != 0) {
        wrong(name + " is called '" + comment + "'" +
              (entry != names.end() ? ", the map has '" + entry->second + "'"
                                    : ", and the map does not name it"));
      }
      if (kind == "DO") continue;
      const auto seen = parse_snpx_variable(name);
      const int word = kind == "PR" ? position_words::joints : 1;
      if (!seen || !locate(map.assignments, *seen, word)) wrong(name + " is in no assignment");
    }
  }
  return listing;
}

const char* const map_file = "config/registers/snpx.yaml";

Listing shipped(const std::string& program, const std::string& from = "",
                const std::string& to = "") {
  std::string text = read_file("examples/8_controller/" + program);
  if (!from.empty()) {
    REQUIRE(text.find(from) != std::string::npos);
    text.replace(text.find(from), from.size(), to);
  }
  return parse(text, names_of(map_file), RegisterMap::load(map_file));
}

TEST_CASE("the controller's programs keep the map's registers, and name them as it does") {
  const Listing status = shipped("berth_bg.ls");
  const Listing motion = shipped("berth_move.ls");
  CHECK(status.wrong == std::vector<std::string>{});
  CHECK(motion.wrong == std::vector<std::string>{});

  Config numbers = Config::load(map_file).section("numbers");
  const RegisterMap map = RegisterMap::load(map_file);
  for (const std::string& key : numbers.keys()) {
    const std::string name = numbers.text(key);
    const auto at = locate(map.assignments, *parse_snpx_variable(name), 1);
    REQUIRE(at);
    INFO(key << ": " << name);
    const bool of_the_host = map.command.contains(at->address, 2);
    const bool written = status.written.contains(name) || motion.written.contains(name);
    CHECK(written == !of_the_host);  // each by one side alone
    const bool read = status.read.contains(name) || motion.read.contains(name);
    if (of_the_host && key != "setpoint_time") CHECK(read);
  }
  CHECK(motion.read.contains("PR[1]"));
  for (const char* coil : {"DO[3]", "DO[4]", "DO[5]"}) CHECK(status.read.contains(coil));

  // The clock as the map has it.
  const std::string text = read_file("examples/8_controller/berth_bg.ls");
  const std::string wrap = std::to_string(map.counter_wrap);
  CHECK_THAT(text,
             Catch::Contains("R[1:tick]=((R[1:tick]+" +
                             std::to_string(map.tick_period / millisecond) + ") MOD " + wrap));
  CHECK_THAT(text, Catch::Contains("R[2:heartbeat]+1) MOD " + wrap));
}

TEST_CASE("a listing that disagrees with the map is found out") {
  CHECK(shipped("berth_bg.ls", "R[4:state]=", "R[5:state]=").wrong.size() == 1);
  CHECK(shipped("berth_bg.ls", "DO[4:hold]", "DO[5:hold]").wrong.size() == 1);
  CHECK(shipped("berth_bg.ls", "R[9:spare host age]", "R[20:spare host age]").wrong.size() == 1);
  CHECK(shipped("berth_bg.ls", "R[33:host_heartbeat]", "R[33]").wrong.size() == 1);
  CHECK(shipped("berth_move.ls", "PR[1:setpoint]", "PR[3:setpoint]").wrong.size() == 2);
  CHECK(shipped("berth_move.ls", "R[36:mode]", "R[37:mode]").wrong.size() == 2);
}

}  // namespace
}  // namespace berth
