// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/departure_scene.h"

#include <algorithm>
#include <cmath>

#include "test/catch.h"

namespace berth::benchmark {
namespace {

const Departures& world_named(const std::string& name) {
  const auto& all = departure_worlds("config");
  const auto found =
      std::find_if(all.begin(), all.end(), [&name](const Departures& w) { return w.name == name; });
  REQUIRE(found != all.end());
  return *found;
}

std::unique_ptr<DepartedScene> scene_of(const SceneMaker& maker, const std::string& world) {
  Random random(7, "departed scene");
  return maker.make(world_named(world), random);
}

/// What the same beams meet in two worlds, without noise of range.
struct Compared {
  int both = 0;
  int one = 0;  ///< met the target in one world alone
  double rms_m = 0;
};

Compared compared(const Scan& a, const Scan& b) {
  REQUIRE(a.beams.size() == b.beams.size());
  Compared result;
  double sum = 0;
  for (std::size_t i = 0; i < a.faces.size(); ++i) {
    const bool in_a = a.faces[i].range > 0;
    const bool in_b = b.faces[i].range > 0;
    result.one += in_a != in_b ? 1 : 0;
    if (!in_a || !in_b) continue;
    const double apart = b.faces[i].range - a.faces[i].range;
    if (std::abs(apart) > 0.1) continue;  // another surface
    ++result.both;
    sum += apart * apart;
  }
  result.rms_m = std::sqrt(sum / result.both);
  return result;
}

}  // namespace

TEST_CASE("a blanket moves what is seen along the rays and leaves rims where they are",
          "[departures]") {
  const SceneMaker maker("config", "radarsat2", false);
  const auto modelled = scene_of(maker, "as believed");
  const auto blanket = scene_of(maker, "blanket");
  const auto warp = scene_of(maker, "warp");
  CHECK(distance(modelled->truth(), blanket->truth()) == 0);
  const Scan a = modelled->scan(2000);
  CHECK(a.returns == Approx(2000).epsilon(0.1));
  const Compared covered = compared(a, blanket->scan(2000));
  CHECK(covered.rms_m > 0.004);
  CHECK(covered.rms_m < 0.013);
  const Compared again = compared(a, modelled->scan(2000));  // new noise of the angles
  CHECK(covered.one < 2 * again.one + 10);
  const Window window = window_around(maker.target().mesh, modelled->truth(), 0.05);
  const Window counted = {
      window.azimuth, window.elevation, window.width, window.height, Pattern::raster, 8000, 0, ""};
  const Compared warped = compared(modelled->sweep({counted}, World::first_utime),
                                   warp->sweep({counted}, World::first_utime));
  CHECK(warped.rms_m > 0.004);
  CHECK(warped.one > again.one);
}

TEST_CASE("the appendage is about a fifth of the surface and turns about its inner end",
          "[departures]") {
  const Target target = with_appendage(load_target("radarsat2", 3));
  REQUIRE(target.parts.size() == 2);
  const auto turning = std::count(target.part_of.begin(), target.part_of.end(), 1);
  CHECK(turning > 0);
  CHECK(turning < static_cast<std::ptrdiff_t>(target.part_of.size()) / 2);
  const Mesh turned = turned_mesh(target, {0, radians(10)});
  double farthest = 0;
  for (std::size_t t = 0; t < target.mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double moved = (target.mesh.vertices[target.mesh.triangles[t][k]] -
                            turned.vertices[turned.triangles[t][k]])
                               .norm();
      if (target.part_of[t] == 0) CHECK(moved == 0);
      farthest = std::max(farthest, moved);
    }
  }
  CHECK(farthest > 0.05);
}

TEST_CASE("a target that the arm holds is seen with walls behind it", "[departures]") {
  const SceneMaker maker("config", "radarsat2", true);
  const auto scene = scene_of(maker, "all of it");
  CHECK(scene->truth().position.z() > 4.5);
  CHECK(scene->truth().position.z() < 6);
  const Scan scan = scene->scan(1000);
  int others = 0;
  for (std::size_t i = 0; i < scan.beams.size(); ++i) {
    if (scan.beams[i].status == BeamStatus::hit && scan.faces[i].range == 0) ++others;
  }
  CHECK(scan.returns > 700);
  CHECK(others > 1000);
}

}  // namespace berth::benchmark
