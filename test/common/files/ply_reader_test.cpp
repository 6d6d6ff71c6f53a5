// SPDX-License-Identifier: BSD-3-Clause
#include "common/files/ply_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "test/catch.h"

using namespace berth;
using namespace berth::files;
using Catch::Matchers::Contains;

namespace {

template <class Value>
std::string raw(Value value, bool big_endian) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string joined_lines(const std::vector<std::string>& lines, const std::string& end = "\n") {
  std::string text;
  for (const std::string& line : lines) text += line + end;
  return text;
}

std::string refusal(const std::string& bytes) {
  try {
    PlyReader ply(bytes, "a.ply");
    while (ply.next()) {
      for (int i = 0; i < static_cast<int>(ply.element().properties.size()); ++i) {
        if (ply.element().properties[static_cast<std::size_t>(i)].is_list) {
          ply.list(i);
        } else {
          ply.value(i);
        }
      }
    }
  } catch (const InputError& e) {
    return e.what();
  }
  return "read";
}

const std::vector<std::string> two_points = {"ply",
                                             "format ascii 1.0",
                                             "comment made by hand",
                                             "element vertex 2",
                                             "property float x",
                                             "property list uchar int neighbours",
                                             "property double y",
                                             "end_header",
                                             "1 0 -2.5",
                                             "1e-400 2 7 8 +0.1"};

void replace(std::string& text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
}

}  // namespace

TEST_CASE("a PLY text is read row by row, lists of any length among scalars, whatever ends a line",
          "[ply]") {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    const std::string text = joined_lines(two_points, end);
    PlyReader ply(text, "a.ply");
    CHECK(ply.comments() == std::vector<std::string>{"made by hand"});
    const PlyElement* vertex = ply.find("vertex");
    REQUIRE(vertex != nullptr);
    CHECK(ply.find("face") == nullptr);
    CHECK(vertex->find("z") == -1);
    REQUIRE(ply.next());
    CHECK(ply.value(vertex->find("y")) == -2.5);
    CHECK(ply.list(vertex->find("neighbours")).empty());
    REQUIRE(ply.next());
    CHECK(ply.value(vertex->find("x")) == 0);
    CHECK(ply.value(vertex->find("y")) == 0.1);  // a double, though declared after floats
    CHECK(ply.list(vertex->find("neighbours"))[1] == 8);
    CHECK_FALSE(ply.next());
    CHECK_FALSE(ply.next());
  }
}

TEST_CASE("binary PLY of every scalar type in both byte orders is read exactly", "[ply]") {
  for (const bool big : {false, true}) {
    std::string bytes = joined_lines(
        {"ply", big ? "format binary_big_endian 1.0" : "format binary_little_endian 1.0",
         "element first 2", "property int8 a", "property uchar b", "property list ushort short c",
         "property uint16 d", "property int e", "property uint32 f", "property float32 g",
         "property double h", "property uint64 i", "element none 5", "element last 1",
         "property char z", "end_header"});
    for (int row = 0; row < 2; ++row) {
      bytes += raw<std::int8_t>(-10, big) + raw<std::uint8_t>(200, big);
      bytes += raw(static_cast<std::uint16_t>(row), big);
      if (row == 1) bytes += raw<std::int16_t>(-300, big);
      bytes += raw<std::uint16_t>(60000, big) + raw<std::int32_t>(-70000, big) +
               raw<std::uint32_t>(4000000000U, big) + raw(1.5F, big) + raw(4600000.1, big) +
               raw<std::uint64_t>(1700000000000000, big);
    }
    bytes += raw<std::int8_t>(7, big);
    PlyReader ply(bytes, "a.ply");
    const std::vector<double> expected = {-10, 200, 0, 60000, -70000, 4e9, 1.5, 4600000.1, 1.7e15};
    for (std::size_t row = 0; row < 2; ++row) {
      REQUIRE(ply.next());
      CHECK(ply.row() == row);
      REQUIRE(ply.list(2).size() == row);
      if (row == 1) CHECK(ply.list(2)[0] == -300);
      for (int i = 0; i < 9; ++i) {
        if (i != 2) CHECK(ply.value(i) == expected[static_cast<std::size_t>(i)]);
      }
    }
    REQUIRE(ply.next());
    CHECK(ply.element().name == "last");
    CHECK(ply.value(0) == 7);
    CHECK_FALSE(ply.next());
    for (std::size_t left = bytes.find("end_header") + 11; left < bytes.size(); ++left) {
      INFO(left);
      CHECK_THAT(refusal(bytes.substr(0, left)), Contains("a.ply") && Contains("cut short"));
    }
    CHECK_THAT(refusal(bytes + "\n"), Contains("1 bytes follow"));
  }
}

TEST_CASE("binary PLY data may begin with the bytes that end lines", "[ply]") {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    for (const char first : {'\n', '\r', 'p', '\0'}) {
      const std::string bytes = joined_lines({"ply", "format binary_little_endian 1.0",
                                              "element vertex 2", "property uchar x", "end_header"},
                                             end) +
                                first + '\x0A';
      PlyReader ply(bytes, "a.ply");
      REQUIRE(ply.next());
      CHECK(ply.value(0) == static_cast<double>(static_cast<unsigned char>(first)));
      REQUIRE(ply.next());
      CHECK(ply.value(0) == 10);
      CHECK_FALSE(ply.next());
    }
  }
}

TEST_CASE("a PLY file that does not hold what it declares is refused, by line or byte", "[ply]") {
  const std::string good = joined_lines(two_points);
  REQUIRE(refusal(good) == "read");
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    replace(text, from, to);
    return refusal(text);
  };
  CHECK_THAT(changed("1 0 -2.5\n", ""),
             Contains("a.ply:9") && Contains("2 rows of 'vertex' declared, 1 there"));
  CHECK_THAT(changed("1 0 -2.5", "1 0 -2.5 9"),
             Contains("a.ply:9: vertex 0: found 4 values, expected 3"));
  CHECK_THAT(changed("1 0 -2.5", "1 2 7 -2.5"), Contains("a.ply:9") && Contains("too few for 'y'"));
  CHECK_THAT(changed("1 0 -2.5", "1 -1 -2.5"),
             Contains("a.ply:9") && Contains("found '-1' for 'neighbours'"));
  CHECK_THAT(changed("1 0 -2.5", "1 0.5 -2.5"), Contains("a.ply:9") && Contains("whole number"));
  CHECK_THAT(changed("1 0 -2.5", "1,5 0 -2.5"),
             Contains("a.ply:9") && Contains("found '1,5' for 'x'"));
  CHECK_THAT(changed("2 7 8 +0.1", "2 7 8 1\n3 0 1"),
             Contains("a.ply:11") && Contains("expected the end"));
  CHECK_THAT(changed("vertex 2", "vertex 99999999999"), Contains("cut short"));
  CHECK_THAT(changed("vertex 2", "vertex -2"),
             Contains("a.ply:4") && Contains("element NAME COUNT"));
  CHECK_THAT(changed("float x", "real x"), Contains("a.ply:5") && Contains("property TYPE NAME"));
  CHECK_THAT(changed("list uchar", "list float"), Contains("a.ply:6"));
  CHECK_THAT(changed("double y", "double x"), Contains("a.ply:7") && Contains("second property"));
  CHECK_THAT(changed("element vertex", "elements vertex"),
             Contains("a.ply:4") && Contains("'elements'"));
  CHECK_THAT(changed("ascii", "binary"), Contains("a.ply:2") && Contains("format"));
  CHECK_THAT(changed("1.0", "2.0"), Contains("a.ply:2"));
  CHECK_THAT(changed("end_header", "endheader"), Contains("end_header"));
  CHECK_THAT(refusal(""), Contains("a.ply") && Contains("no PLY file"));
  CHECK_THAT(refusal("solid s\n"), Contains("a.ply:1") && Contains("no PLY file"));

  PlyReader ply(good, "a.ply");
  REQUIRE(ply.next());
  CHECK_THROWS_WITH(ply.value(1), Contains("declared as a list"));
  CHECK_THROWS_WITH(ply.list(0), Contains("expected a list"));
}
