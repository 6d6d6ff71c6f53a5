// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/config_override.h"

#include <fstream>

#include "common/core/error.h"
#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using Catch::Matchers::Contains;

namespace {

const std::string lidar_file = R"(# A file.
rate: 2000 Hz      # beams
beam:
  noise: 1 cm      # of a range
  name: 'a b'
field: [40 deg, 40 deg]   # full
parts: {one: 3, two: 4}
long:
  - 1
  - 2
)";

std::string changed(const std::string& key, const std::string& value) {
  const TemporaryDirectory directory;
  write_file(directory / "lidar.yaml", lidar_file);
  override_configuration(directory.path(), {{"lidar.yaml:" + key, value}, {"speed", "1 m/s"}});
  return read_file(directory / "lidar.yaml");
}

std::string override_error(const std::string& key, const std::string& value) {
  try {
    changed(key, value);
  } catch (const InputError& e) {
    return e.what();
  }
  return "none";
}

std::string replaced(const std::string& from, const std::string& to) {
  std::string copy = lidar_file;
  return copy.replace(copy.find(from), from.size(), to);
}

}  // namespace

TEST_CASE("a key of a configuration file is changed where it stands, and nothing else is") {
  CHECK(changed("rate", "1 kHz") == replaced("2000 Hz", "1 kHz"));
  CHECK(changed("beam.noise", "25 mm") == replaced("1 cm", "25 mm"));
  CHECK(changed("beam.name", "c") == replaced("'a b'", "'c'"));
  CHECK(changed("beam.name", "it's: #1") == replaced("'a b'", "\"it's: #1\""));
  CHECK(changed("field", "[20 deg,30 deg]") == replaced("[40 deg, 40 deg]", "[20 deg, 30 deg]"));
  CHECK(changed("field", "[20 deg, 30 deg]") == replaced("[40 deg, 40 deg]", "[20 deg, 30 deg]"));
  CHECK(changed("parts.one", "7") == replaced("3", "7"));
}

TEST_CASE("a value of another kind, or a key that is not there, is refused") {
  CHECK_THAT(override_error("rate", "1 m"), Contains("1 m"));
  CHECK_THAT(override_error("rate", "[1 Hz]"), Contains("found '[1 Hz]', expected a frequency"));
  CHECK_THAT(override_error("field", "[20 deg]"), Contains("expected a list such as"));
  CHECK_THAT(override_error("beam", "1"), Contains("no single value"));
  CHECK_THAT(override_error("beam.nose", "1 cm"),
             Contains("no key 'nose' of 'beam.nose'; there are: noise, name"));
  CHECK_THAT(override_error("rate", "1 Hz # really"),
             Contains("found '1 Hz # really', expected a frequency"));
  CHECK_THAT(override_error("long", "[3, 4]"), Contains("not written on one line"));
  const TemporaryDirectory directory;
  CHECK_THROWS_WITH(check_override(directory.path(), "../x.yaml:a", "1"), Contains("no file"));
}
