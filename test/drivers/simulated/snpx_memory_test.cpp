// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/snpx_memory.h"

#include "test/catch.h"

namespace berth {
namespace {

Word word(const SnpxMemory& memory, int address) {
  Word value = 0xaaaa;
  memory.read(address, {&value, 1});
  return value;
}

float number(const SnpxMemory& memory, int address) {
  Word two[2];
  memory.read(address, two);
  return get_float(two);
}

TEST_CASE("unassigned registers read 0 and swallow writes") {
  SnpxMemory memory({{1, 1, 4, "R[1]", 0}});
  memory.numbers[1] = 2.5;
  const Word written[] = {7, 7, 7, 7, 7, 7};
  memory.write(4, written);
  CHECK(number(memory, 1) == 2.5f);
  CHECK(word(memory, 5) == 0);
  CHECK(word(memory, 9) == 0);
}

TEST_CASE("where two assignments overlap the lower slot wins, in reading and in writing") {
  SnpxMemory memory({{1, 3, 2, "R[20]", 0}, {2, 1, 6, "R[1]", 0}});
  memory.numbers[1] = 1;
  memory.numbers[2] = 2;
  memory.numbers[3] = 3;
  memory.numbers[20] = 20;
  CHECK(number(memory, 1) == 1.0f);
  CHECK(number(memory, 3) == 20.0f);
  CHECK(number(memory, 5) == 3.0f);
  Word written[6];
  put_float(11, written);
  put_float(12, written + 2);
  put_float(13, written + 4);
  memory.write(1, written);
  CHECK(memory.numbers[1] == 11);
  CHECK(memory.numbers[2] == 2);
  CHECK(memory.numbers[20] == 12);
  CHECK(memory.numbers[3] == 13);
}

TEST_CASE("numbers are shown as float32, scaled int32 or, one word wide, as int16") {
  SnpxMemory memory({{1, 1, 2, "R[5]", 0}, {2, 3, 2, "R[5]", 100}, {3, 5, 2, "R[5]@1.1", 1}});
  memory.numbers[5] = -12.345;
  memory.numbers[6] = 77;
  CHECK(number(memory, 1) == -12.345f);
  Word two[2];
  memory.read(3, two);
  CHECK(get_int32(two) == -1235);  // rounded
  CHECK(static_cast<std::int16_t>(word(memory, 5)) == -12);
  CHECK(word(memory, 6) == 77);
}

TEST_CASE("half a number may be written; the other half stays") {
  SnpxMemory memory({{1, 1, 2, "R[1]", 1}});
  memory.numbers[1] = 0x00020003;
  const Word high = 5;
  memory.write(2, {&high, 1});
  CHECK(memory.numbers[1] == 0x00050003);
}

TEST_CASE("POS shows a position in both forms and ignores writes; PR takes them") {
  SnpxMemory memory({{1, 1, 50, "POS[0]", 0}, {2, 101, 19, "PR[1]@27.19", 0}});
  memory.position.cartesian = {1341, 0, 1040, 180, -90, 0};
  memory.position.joints = {1, 2, 3, 4, 5, 6};
  memory.position.joints_valid = true;
  CHECK(number(memory, 1) == 1341.0f);
  CHECK(number(memory, 5) == 1040.0f);
  CHECK(number(memory, 27) == 1.0f);
  CHECK(number(memory, 37) == 6.0f);
  CHECK(word(memory, 45) == 1);
  Word written[19] = {};
  put_float(33, written);
  written[18] = 1;
  memory.write(27, written);
  CHECK(number(memory, 27) == 1.0f);
  memory.write(101, written);
  CHECK(memory.position_registers[1].joints[0] == 33);
  CHECK(memory.position_registers[1].joints_valid);
}

TEST_CASE("through slot 80 any assignment can be read back, and changed") {
  SnpxMemory memory({{1, 1, 4, "R[1]", 0},
                     {76, 16300, 2, "$SNPX_ASG[80].$ADDRESS", 1},
                     {77, 16302, 2, "$SNPX_ASG[80].$SIZE", 1},
                     {78, 16304, 40, "$SNPX_ASG[80].$VAR_NAME", -1},
                     {79, 16344, 2, "$SNPX_ASG[80].$MULTIPLY", 0}});
  Word window[46] = {};
  put_int32(16250, window);
  put_int32(40, window + 2);
  put_text("$SNPX_ASG[1].$VAR_NAME", std::span(window).subspan(4, 40));
  put_float(-1, window + 44);
  memory.write(16300, window);
  Word name[40];
  memory.read(16250, name);
  CHECK(get_text(name) == "R[1]");
  put_text("R[9]", name);
  memory.write(16250, name);
  REQUIRE(memory.assignment(1) != nullptr);
  CHECK(memory.assignment(1)->variable == "R[9]");
  memory.numbers[9] = 4;
  CHECK(number(memory, 1) == 4.0f);
}

TEST_CASE("program and alarm are shown as words and text") {
  SnpxMemory memory({{1, 83, 18, "PRG[1]", -1}, {2, 401, 100, "ALM[1]", -1}});
  memory.program_state = 2;
  CHECK(word(memory, 92) == 2);
  CHECK(word(memory, 83) == 0x4245);  // "BE"
  CHECK(word(memory, 402) == 0);
  memory.alarm_number = 103;
  memory.alarm_text = "SRVO-001";
  CHECK(word(memory, 402) == 103);
  CHECK(word(memory, 412) == 0x5352);  // "SR"
}

}  // namespace
}  // namespace berth
