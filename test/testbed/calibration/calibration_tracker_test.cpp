// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/error.h"
#include "test/catch.h"
#include "testbed/calibration/tracker_file.h"

namespace berth::testbed {
namespace {

std::string error_of(const std::string& text) {
  try {
    parse_tracker_file(text, "t.csv", load_tracker_setup("config/tracker.yaml"));
  } catch (const InputError& e) {
    return e.what();
  }
  return "none";
}

TEST_CASE("a tracker's file is read by its header, comments and other columns passed over") {
  const auto lines = parse_tracker_file(
      "# AT960\ntime,x,y,z,point,rms\n\n10.5, 1000,-2.5,3,R2,0.01\r\n11,0,0,0,S1,0\n", "t.csv",
      load_tracker_setup("config/tracker.yaml"));
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].time == 10.5);
  CHECK(lines[0].point.isApprox(Vector3d(1, -0.0025, 0.003)));
  CHECK(lines[0].reflector == 5);
  CHECK(lines[1].reflector == 0);
}

TEST_CASE("errors in a tracker's file are named with their line") {
  CHECK(error_of("") == "t.csv:0: found no header, expected time,point,x,y,z");
  CHECK(error_of("time,x,y,z\n").find("t.csv:1: found no column 'point'") == 0);
  CHECK(error_of("time,point,x,y,z\n1,S1,2,3\n").find("t.csv:2: found 4 columns") == 0);
  CHECK(error_of("time,point,x,y,z\n1,S9,2,3,4\n").find("found 'S9'") != std::string::npos);
  CHECK(error_of("time,point,x,y,z,w,p,r\n").find("t.csv:1: found a column 'w'") == 0);
  CHECK(error_of("time,point,x,y,z\n1,S1,2,3,nan\n").find("z: found 'nan'") != std::string::npos);
}

}  // namespace
}  // namespace berth::testbed
