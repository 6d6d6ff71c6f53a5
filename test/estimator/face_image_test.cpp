// SPDX-License-Identifier: BSD-3-Clause
// Dense scans take what a beam meets from an image of the target: it must say what a cast says.
#include "estimator/tracking/face_image.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "common/core/mesh.h"
#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/beam_selection.h"
#include "estimator/tracking/foreground.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

/// The triangle named for one point, or unknown.
std::int32_t foremost(const FaceImage& image, const Vector3d& point) {
  return image.foremost(four(point))[0];
}

bool within(const TargetModel& model, std::int32_t triangle, const Vector3d& point, double depth) {
  return count(model.borders.within(static_cast<std::uint32_t>(triangle), four(point),
                                    four(depth))) == 4;
}

/// Thin plates one behind another, a box behind them, a strut through all, and a plate inside of
/// another.
Mesh plates() {
  Mesh mesh = make_box({1.2, 0.6, 0.01});
  mesh.append(make_box({0.5, 0.5, 0.005}), Pose{{0.2, 0.1, 0.03}, Quaterniond::Identity()});
  mesh.append(make_box({0.8, 0.8, 0.3}), Pose{{-0.3, 0, -0.4}, Quaterniond::Identity()});
  mesh.append(make_strut({-0.6, -0.3, -0.5}, {0.6, 0.3, 0.4}, 0.02));
  mesh.append(make_box({0.3, 0.3, 0.002}), Pose{{0.2, 0.1, 0.03}, Quaterniond::Identity()});
  return mesh;
}

std::shared_ptr<const TargetModel> plates_model() {
  static const auto model = [] {
    Target target;
    target.mesh = plates();
    return std::make_shared<const TargetModel>(target, ModelOptions{});
  }();
  return model;
}

}  // namespace

TEST_CASE("Where an image of the target names a face, every beam meets that, and nothing near it") {
  const auto model = GENERATE(replica_model(), cube_model(), plates_model());
  const double sway = GENERATE(0.0, 0.03);
  Random random(3, "face image");
  int named = 0;
  int met = 0;
  for (int view = 0; view < 12; ++view) {
    const double distance = random.uniform(2.5 * model->radius, 8 * model->radius);
    const Pose from = random_pose(random, distance).inverse();
    const double reach = random.uniform() < 0.5 ? 0 : 4e-4;
    const FaceImage image(*model, {from.position, sway, reach}, 60 + 40 * (view % 5));
    for (int i = 0; i < 4000; ++i) {
      const Vector3d aim = model->centre + random.normal_vector(0.4 * model->radius);
      const Vector3d aside_of_it = random.normal_vector(1).normalized();
      const Vector3d eye = from.position + random.uniform() * sway * aside_of_it;
      const Ray ray{eye, (aim - eye).normalized()};
      RayHit hit;
      if (!model->caster.cast(ray, 100, hit)) continue;
      ++met;
      const Vector3d point = eye + hit.range * ray.direction;
      const double off = random.uniform(-1, 1) * FaceImage::slack_m;
      const Vector3d returned = point + off * ray.direction;
      const std::int32_t triangle = foremost(image, returned);
      if (triangle == FaceImage::unknown) continue;
      RayHit there;
      model->caster.meet(ray, static_cast<std::uint32_t>(triangle), there);
      const Vector3d on_plane = eye + there.range * ray.direction;
      if (!within(*model, triangle, on_plane, 0)) continue;
      if (sway > 0 && (on_plane - returned).norm() > FaceImage::slack_m) continue;
      ++named;
      INFO("view " << view << ", beam " << i);
      REQUIRE(there.range == Approx(hit.range).margin(1e-5));
      if (reach == 0) continue;
      // A beam as far beside it as the reach meets nothing before that plane.
      const Vector3d aside = ray.direction.cross(random.normal_vector(1)).normalized();
      const Ray beside{eye, (ray.direction + reach * aside).normalized()};
      RayHit beside_hit;
      if (!model->caster.cast(beside, 100, beside_hit)) continue;
      model->caster.meet(beside, static_cast<std::uint32_t>(triangle), there);
      CHECK(beside_hit.range > there.range - 1e-5);
    }
  }
  CHECK(named > 0.5 * met);
}

TEST_CASE("Seen from too near or from within, an image of the target names nothing") {
  const auto model = replica_model();
  for (const double distance : {0.0, 0.5, 1.0}) {
    const FaceImage image(*model, {model->centre + Vector3d(0, 0, -distance * model->radius), 0, 0},
                          100);
    CHECK(foremost(image, model->centre) == FaceImage::unknown);
  }
  const FaceImage image(*model, {{0, 0, -8}, 0, 0}, 100);
  CHECK(foremost(image, {50, 0, 0}) == FaceImage::unknown);  // beside
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(foremost(image, {inf, 0, inf}) == FaceImage::unknown);
  CHECK(foremost(image, {std::nan(""), 0, 0}) == FaceImage::unknown);
}

namespace {

/// Whether beams all around one, as far off as its angle noise makes it doubtful, meet one plane.
bool of_one_face(const TargetModel& model, const Pose& pose, const Beam& beam,
                 std::uint32_t triangle, double reach) {
  const Pose back = pose.inverse();
  const Vector3d right = beam.direction.unitOrthogonal();
  const Vector3d up = beam.direction.cross(right);
  for (int i = 0; i < 16; ++i) {
    const double angle = radians(22.5 * i);
    const Vector3d beside =
        (beam.direction + reach * (std::cos(angle) * right + std::sin(angle) * up)).normalized();
    const Ray ray{back.position, back.rotation * beside};
    RayHit hit;
    RayHit plane;
    model.caster.meet(ray, triangle, plane);
    if (!model.caster.cast(ray, 100, hit) || std::abs(hit.range - plane.range) > 1e-4) return false;
  }
  return true;
}

/// In parts that are too small for an image of the target.
template <class Sum>
void in_parts(const BeamPicks& picks, const Sum& sum) {
  constexpr std::size_t part = 4000;
  for (std::size_t i = 0; i < picks.size(); i += part) {
    sum(std::span(picks).subspan(i, std::min(part, picks.size() - i)));
  }
}

}  // namespace

TEST_CASE("A dense scan says what its beams say when each is cast") {
  const auto model = replica_model();
  BeamModel noise;
  const bool blurred = GENERATE(false, true);
  if (blurred) noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 1e-3;
  const bool moves = GENERATE(false, true);
  ScanMaker lidar(model->target.mesh, 4);
  lidar.beam = noise;
  lidar.rate_hz = 200000;
  lidar.pose = paper_pose;
  if (moves) lidar.velocity = {{0.05, -0.02, 0.1}, {0.02, 0.1, -0.05}};
  const std::int64_t first = lidar.utime;
  const CleanScan scan = preprocess(lidar.sweep(around(*model, paper_pose, 120000)), {}, noise);
  const BeamPicks& returns = scan.beam_of_point;
  REQUIRE(returns.size() > 25000);
  const auto pose_at = [&](std::int64_t utime) {
    return moved(paper_pose, lidar.velocity, static_cast<double>(utime - first) * 1e-6);
  };
  const Pose middle = pose_at(scan.utime_mean);
  const BeamLinearisation at{{middle, lidar.velocity}, scan.utime_mean, prior(2e-4, 2e-5)};
  const Foreground foreground(*model, middle.inverse().position);
  BeamInformationOptions how;
  how.edges = false;

  std::vector<MetFace> doubtful;
  const BeamInformation dense =
      beam_information(*model, noise, scan.beams, at, how, returns, doubtful, &foreground);
  std::vector<MetFace> doubtful_when_cast;
  in_parts(returns, [&](std::span<const std::uint32_t> part) {
    std::vector<MetFace> near;
    beam_information(*model, noise, scan.beams, at, how, part, near, &foreground);
    doubtful_when_cast.insert(doubtful_when_cast.end(), near.begin(), near.end());
  });

  // Some beams are doubted when cast for an end that is hidden: no others are sure in the image.
  const auto earlier = [](const MetFace& a, const MetFace& b) { return a.beam < b.beam; };
  REQUIRE(std::is_sorted(doubtful.begin(), doubtful.end(), earlier));
  CHECK(std::includes(doubtful_when_cast.begin(), doubtful_when_cast.end(), doubtful.begin(),
                      doubtful.end(), earlier));
  std::vector<MetFace> sure;
  std::set_difference(doubtful_when_cast.begin(), doubtful_when_cast.end(), doubtful.begin(),
                      doubtful.end(), std::back_inserter(sure), earlier);
  CHECK(sure.size() < 0.01 * returns.size());
  for (const MetFace& met : sure) {
    const Beam& beam = scan.beams[met.beam];
    CHECK(of_one_face(*model, pose_at(beam.utime), beam, met.triangle,
                      how.edge_sigmas * noise.azimuth_sigma_rad));
  }

  // The others say the same.
  BeamPicks certain;
  auto next = doubtful.begin();
  for (const std::uint32_t beam : returns) {
    if (next != doubtful.end() && next->beam == beam) {
      ++next;
    } else {
      certain.push_back(beam);
    }
  }
  REQUIRE(certain.size() + doubtful.size() == returns.size());
  BeamInformation cast;
  in_parts(certain, [&](std::span<const std::uint32_t> part) {
    cast += beam_information(*model, noise, scan.beams, at, how, part);
  });
  CHECK(dense.used == cast.used);
  CHECK(dense.predicted == cast.predicted);
  CHECK(dense.chi2 == Approx(cast.chi2));
  CHECK(dense.cost == Approx(cast.cost));
  CHECK(dense.motion().information.isApprox(cast.motion().information, 1e-9));
  CHECK(dense.motion().gradient.isApprox(cast.motion().gradient, 1e-6));
}
