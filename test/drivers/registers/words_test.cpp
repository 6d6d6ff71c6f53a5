// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/registers/words.h"

#include <modbus/modbus.h>

#include <array>
#include <limits>

#include "test/catch.h"

namespace berth {
namespace {

using Two = std::array<Word, 2>;

TEST_CASE("a float stands with its low word first") {
  Two words{};
  put_float(1341.5f, words.data());  // 0x44a7b000
  CHECK(words == Two{0xb000, 0x44a7});
  put_float(-1.0f, words.data());  // 0xbf800000
  CHECK(words == Two{0x0000, 0xbf80});
  CHECK(get_float(Two{0x0fdb, 0x4049}.data()) == 3.14159274f);
}

TEST_CASE("libmodbus reads our floats, whose own writing is not to be trusted") {
  for (const float value : {0.0f, 1341.5f, -878.712f, 1e-30f, 16777215.0f}) {
    Two words{};
    put_float(value, words.data());
    CHECK(modbus_get_float_cdab(words.data()) == value);
    CHECK(get_float(words.data()) == value);
  }
}

TEST_CASE("an int32 stands with its low word first") {
  Two words{};
  put_int32(0x00012345, words.data());
  CHECK(words == Two{0x2345, 0x0001});
  for (const std::int32_t value : {0, -1, 70000, std::numeric_limits<std::int32_t>::min()}) {
    put_int32(value, words.data());
    CHECK(get_int32(words.data()) == value);
  }
}

TEST_CASE("text has its first character in the high byte and ends with a zero") {
  std::array<Word, 4> words{};
  put_text("PR[1]", words);
  CHECK(words == std::array<Word, 4>{0x5052, 0x5b31, 0x5d00, 0});
  CHECK(get_text(words) == "PR[1]");
  put_text("longer than four words", words);
  CHECK(get_text(words) == "longer t");
}

}  // namespace
}  // namespace berth
