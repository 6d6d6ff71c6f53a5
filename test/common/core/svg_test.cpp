// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/svg.h"

#include "test/catch.h"

using namespace berth;
using Catch::Matchers::Contains;

TEST_CASE("an element has its attributes, escaped, and its content") {
  const std::string any = "<\"&'>";
  CHECK(svg::element("path", {{"class", any}, {"d", ""}, {"x", 2}}).code ==
        "<path class=\"&lt;&quot;&amp;&#39;&gt;\" x=\"2\"/>");
  CHECK(svg::element("b", {}, svg::text(any)).code == "<b>&lt;&quot;&amp;&#39;&gt;</b>");
  CHECK(svg::element("i", {{"title", "t"}}, {}).code == "<i title=\"t\"></i>");
}

TEST_CASE("numbers are as short as a picture needs") {
  CHECK(svg::number(12.34) == "12.3");
  CHECK(svg::number(-0.04) == "0");
  CHECK(svg::number(100) == "100");
  CHECK(std::string_view(svg::Path().add('M', {0.25, -3}).add('H', {7.75}).add('z').dot(1, 2)) ==
        "M0.2 -3H7.8zM1 2h0");
  CHECK(svg::hex({255, 16, 100}, 0.5) == "#7f0832");
}

TEST_CASE("a document states its size") {
  CHECK_THAT(svg::document(20, 10.5, "#fff", svg::text("<")), Contains("viewBox=\"0 0 20 10.5\"") &&
                                                                  Contains("width=\"20\"") &&
                                                                  Contains("&lt;</svg>\n"));
}
