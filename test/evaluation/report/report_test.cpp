// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <random>

#include "evaluation/report/axis.h"
#include "evaluation/report/chart.h"
#include "evaluation/report/html.h"
#include "test/catch.h"

using namespace berth::report;

namespace {

bool has(const Html& html, const std::string& what) {
  return html.code.find(what) != std::string::npos;
}

std::size_t count_of(const Html& html, const std::string& what) {
  std::size_t count = 0;
  for (auto at = html.code.find(what); at != std::string::npos; at = html.code.find(what, at + 1)) {
    ++count;
  }
  return count;
}

Curve wave(std::size_t points) {
  Curve curve{"wave"};
  for (std::size_t i = 0; i < points; ++i) {
    const double x = 0.01 * static_cast<double>(i);
    curve.add(x, std::sin(x));
  }
  return curve;
}

}  // namespace

TEST_CASE("text from a log cannot become markup", "[report]") {
  CHECK(text("<script>alert('&\"')</script>").code ==
        "&lt;script&gt;alert(&#39;&amp;&quot;&#39;)&lt;/script&gt;");
  CHECK(text("3 \xC2\xB5m, \xE2\x88\x9E").code == "3 \xC2\xB5m, \xE2\x88\x9E");
  CHECK(text(std::string("\xC0\xAF\x01\xED\xA0\x80", 6)).code ==
        "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD");
  CHECK(link("a dir/\"x\".yaml", text("x")).code == "<a href=\"./a%20dir/%22x%22.yaml\">x</a>");
  CHECK(has(link("javascript:alert(1)", text("x")), "\"./javascript%3Aalert%281%29\""));
}

TEST_CASE("any bytes come out as well-formed text without markup", "[report]") {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string any;
    for (int i = 0; i < 20; ++i) any += static_cast<char>(byte(random));
    const Html once = text(any);
    CHECK(once.code.find_first_of("<>\"'") == std::string::npos);
    // Escaping what has no character to escape changes nothing: all of it was well formed.
    Html without_entities = once;
    for (auto at = without_entities.code.find('&'); at != std::string::npos;
         at = without_entities.code.find('&')) {
      without_entities.code.erase(at, 1);
    }
    CHECK(text(without_entities.code).code == without_entities.code);
  }
}

TEST_CASE("ticks are round numbers inside the axis", "[report]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1000, 1000);
  for (int trial = 0; trial < 500; ++trial) {
    const Axis axis = axis_for({number(random), number(random)}, false);
    const auto list = ticks(axis, 5);
    REQUIRE(list.size() >= 2);
    CHECK(list.size() <= 6);
    CHECK(ticks(axis, 3).size() >= 2);  // one alone shows no scale
    CHECK(ticks(axis, 3).size() <= 6);
    for (const Tick& tick : list) {
      CHECK(tick.value >= axis.low - 1e-9);
      CHECK(tick.value <= axis.high + 1e-9);
      CHECK(std::stod(tick.label) == Approx(tick.value).margin(1e-6));
    }
  }
  const auto powers = ticks({0.1, 1000, true}, 5);
  REQUIRE(powers.size() == 5);
  CHECK(powers[1].label == "1");
}

TEST_CASE("an axis is never empty and few extremes do not flatten it", "[report]") {
  CHECK(axis_for({}, false).high > axis_for({}, false).low);
  CHECK(axis_for({5, 5, NAN}, false).low < 5);
  CHECK(axis_for({5, 5}, false).high > 5);
  // Values that differ by rounding alone, as those of bit-identical runs averaged in another order.
  CHECK(ticks(axis_for({30.15, std::nextafter(30.15, 31.0)}, false), 5).size() <= 6);
  CHECK(axis_for({-1, 0, 3, 40}, true).low > 0);
  std::vector<double> values(100, 1.0);
  for (std::size_t i = 0; i < 50; ++i) values[i] = 2.0;
  values[7] = 1000;
  CHECK(axis_without_extremes(values, false).high < 3);
  CHECK(axis_for(values, false).high > 1000);
}

TEST_CASE("numbers are shown with their significant digits", "[report]") {
  CHECK(brief(0.30289) == "0.3029");
  CHECK(brief(12345.6) == "12346");
  CHECK(brief(-20.0) == "-20");
  CHECK(brief(NAN) == "\xE2\x80\x93");
  CHECK(brief(3e-7) == "3e-07");
}

TEST_CASE("thinning a curve keeps every column's extremes", "[report]") {
  const Curve curve = wave(100000);
  std::vector<double> y = curve.y;
  y[43210] = 50;
  y[77777] = NAN;
  const auto kept = worth_drawing(curve.x, y, 0, 1000, 500);
  CHECK(kept.size() <= 4 * 500 + 1);
  CHECK(std::is_sorted(kept.begin(), kept.end()));
  CHECK(std::count(kept.begin(), kept.end(), std::size_t{43210}) == 1);
  CHECK(std::count(kept.begin(), kept.end(), std::size_t{77777}) == 1);
  CHECK(worth_drawing(curve.x, curve.y, 0, 1000, 50000).size() == curve.x.size());
}

TEST_CASE("a chart draws its curves, names and what is beyond its scale", "[report]") {
  Chart chart;
  chart.title = "error <x>";
  chart.unit = "mm";
  chart.group = "time";
  chart.curves.push_back(wave(50000));
  Curve dots;
  dots.name = "dots";
  dots.style = Curve::Style::dots;
  dots.x = {1, 2, 3, 4};
  dots.y = {0.5, NAN, 0.25, 7};
  chart.curves.push_back(dots);
  chart.spans.push_back({10, 400, "approach", Span::Kind::phase});
  chart.spans.push_back({20, 30, "lost: \"why\"", Span::Kind::trouble});
  chart.marks.push_back({5, "event", true});
  chart.levels.push_back({0.9, "limit"});
  chart.y_range = {{-1, 1}};
  const Html html = html_of(chart);
  CHECK(has(html, "error &lt;x&gt;"));
  CHECK(has(html, "lost: &quot;why&quot;"));
  CHECK(has(html, "limit"));
  CHECK(has(html, "1 beyond the scale"));
  CHECK(count_of(html, "h0") == 3);  // two dots inside, one at the edge
  CHECK(count_of(html, "<path") == 3);
  CHECK(html.code.size() < 60000);
}

TEST_CASE("a chart of nothing is still a chart", "[report]") {
  CHECK(has(html_of(Chart()), "</figure>"));
  Chart logarithmic;
  logarithmic.log_y = true;
  Curve curve;
  curve.x = {1, 2, 3};
  curve.y = {0, -1, 10};
  logarithmic.curves.push_back(curve);
  CHECK_FALSE(has(html_of(logarithmic), "nan"));
}

TEST_CASE("a page is one file that fetches nothing", "[report]") {
  Page page("run <1>");
  page.head(element("h1", "", text("run <1>")));
  page.section("errors", "Errors", html_of(Chart()));
  const Html html = page.html();
  CHECK(has(html, "<title>run &lt;1&gt;</title>"));
  CHECK(has(html, "<a href=\"#errors\">Errors</a>"));
  CHECK_FALSE(has(html, "http://"));
  CHECK_FALSE(has(html, "https://"));
  CHECK_FALSE(has(html, " src="));
  CHECK(has(html, "default-src 'none'"));
}
