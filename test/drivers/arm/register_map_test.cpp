// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/register_map.h"

#include <unistd.h>

#include <fstream>
#include <sstream>

#include "common/core/error.h"
#include "test/catch.h"

namespace berth {
namespace {

const std::filesystem::path snpx = "config/registers/snpx.yaml";

std::string map_text() {
  std::ifstream in(snpx);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The error on loading the shipped map with one piece of text replaced.
std::string error_of(const std::string& from, const std::string& to) {
  std::string text = map_text();
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  text.replace(at, from.size(), to);
  const auto file = std::filesystem::temp_directory_path() /
                    ("berth-map-" + std::to_string(::getpid()) + ".yaml");
  std::ofstream(file) << text;
  std::string what;
  try {
    RegisterMap::load(file);
  } catch (const InputError& e) {
    what = e.what();
  }
  std::filesystem::remove(file);
  return what;
}

TEST_CASE("the shipped map puts everything where the controllers have it") {
  const RegisterMap map = RegisterMap::load(snpx);
  CHECK(map.position == 1);
  CHECK(map.setpoint_joints == 201);
  CHECK(map.setpoint_valid == 219);
  CHECK(map.program_state == 92);
  CHECK(map.tick.address == 51);
  CHECK(map.tick.form == RegisterField::Form::float32);
  CHECK(map.error.address == 63);
  CHECK(map.setpoint_sequence.address == 220);
  CHECK(map.setpoint_sequence.form == RegisterField::Form::int32);
  CHECK(map.mode.address == 230);
  REQUIRE(map.bootstrap);
  CHECK(map.assignment_table().find("$SNPX_ASG[4].$ADDRESS = 201\n"
                                    "$SNPX_ASG[4].$SIZE = 19\n"
                                    "$SNPX_ASG[4].$VAR_NAME = 'PR[1]@27.19'\n"
                                    "$SNPX_ASG[4].$MULTIPLY = 0\n") != std::string::npos);
}

TEST_CASE("a map that cannot work is refused with file, line and key") {
  CHECK_THAT(error_of("tick: R[1]", "tick: R[17]"),
             Catch::Contains("numbers.tick") && Catch::Contains("'R[17]' is in none"));
  CHECK_THAT(error_of("command: R[32]", "command: R[2]"),
             Catch::Contains("stands at register 53, outside its block"));
  CHECK_THAT(error_of("slot: 2,", "slot: 1,"), Catch::Contains("is used twice"));
  CHECK_THAT(error_of("\"PR[2]@1.26\"", "\"PR[2]@40.26\""), Catch::Contains("PR[2]@40.26"));
  CHECK_THAT(error_of("count: 31", "count: 124"), Catch::Contains("a whole number from 1 to 123"));
  CHECK_THAT(error_of("alarm: ALM[1]", "alarm: ALM[2]"),
             Catch::Contains("none of the assignments"));
  CHECK_THAT(error_of("unit: 1", "unit: 250"), Catch::Contains("found 250, expected 1 to 247"));
  CHECK_THAT(error_of("pulse:", "puls:"), Catch::Contains("'puls'") || Catch::Contains("pulse"));
}

TEST_CASE("status and command blocks in SI units, word by word") {
  RegisterMap map = RegisterMap::load(snpx);
  ArmRegisterCodec codec(map, {true, false, false, false, false, false});
  std::vector<Word> words(100, 0);
  put_float(1250.5f, &words[26]);  // J1, here a linear axis: mm
  put_float(-90.0f, &words[28]);   // J2, deg
  words[44] = 1;                   // VALIDJ
  put_float(16777215.0f, &words[50]);
  put_float(4.0f, &words[56]);
  put_float(80.0f, &words[58]);
  put_float(250.0f, &words[60]);
  words[91] = 2;
  put_float(1341.5f, &words[0]);  // X, mm
  words[25] = 1;                  // VALIDC
  int tick_ms = 0;
  const ArmReport report = codec.decode(words, tick_ms);
  CHECK(report.valid);
  CHECK(report.joints[0] == 1.2505);
  CHECK(report.joints[1] == Approx(radians(-90.0)));
  CHECK(tick_ms == 16777215);
  CHECK(report.state == static_cast<int>(ControllerState::fault));
  CHECK(report.speed_override == 0.8);
  CHECK(report.tcp_speed == 0.25);
  CHECK(report.program_state == 2);
  REQUIRE(report.flange);
  CHECK(*report.flange == Vector3d(1.3415, 0, 0));
  words[46] = 1;  // of a tool, not of the flange
  CHECK_FALSE(codec.decode(words, tick_ms).flange);
  words[44] = 0;
  CHECK_FALSE(codec.decode(words, tick_ms).valid);

  ArmOrder order;
  order.joints = {1.5, radians(45.0), 0, 0, 0, 0};
  order.sequence = 70000;
  order.follow = true;
  order.speed_limit = 0.5;
  order.time = 1735689600 * second;
  const auto block = codec.encode(order, 3);
  REQUIRE(block.size() == 31);
  CHECK(block[0] == 0x8000);  // 1500.0 = 0x44bb8000
  CHECK(block[1] == 0x44bb);
  CHECK(block[2] == 0x0000);  // 45.0 = 0x42340000
  CHECK(block[3] == 0x4234);
  CHECK(block[18] == 1);       // VALIDJ
  CHECK(block[19] == 0x1170);  // 70000 = 0x00011170
  CHECK(block[20] == 0x0001);
  CHECK(block[21] == 1);
  CHECK(block[23] == 3);
  CHECK(block[25] == 50);
  // 1735689600000 ms below 2^24
  CHECK((block[27] | block[28] << 16) == 1735689600000 % 16777216);
}

}  // namespace
}  // namespace berth
