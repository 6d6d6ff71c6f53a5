// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/symmetry.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/core/ray_caster.h"
#include "estimator/model/align_points.h"
#include "estimator/model/closest_point_grid.h"
#include "estimator/model/visible_surface.h"

namespace berth::estimator {

namespace {

/// Distances to the visible surface, truncated and quantised to a byte per voxel: small enough for
/// the processor's cache while some hundred thousand look-ups score rotations. Model frame.
class DistanceTable {
 public:
  static constexpr int most = 255;  ///< the value at and beyond the cut-off

  /// cut_off: m.
  DistanceTable(const ClosestPointGrid& grid, double cut_off);

  /// Of a point of the model frame, in units of cut_off / 255.
  int value(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f place = (point - low_) / cell_;
    return values_[static_cast<std::size_t>(index(place.x(), place.y(), place.z()))];
  }

 private:
  /// Index of a point's voxel; points outside are clamped to the margin, whose distance is the
  /// largest.
  int index(float x, float y, float z) const {
    const auto clamped = [](float v, float top) {
      v = v < 0.0F ? 0.0F : v;  // not std::clamp: this becomes two vector instructions
      return static_cast<int>(v > top ? top : v);
    };
    return clamped(x, top_[0]) + size_[0] * (clamped(y, top_[1]) + size_[1] * clamped(z, top_[2]));
  }
  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  float cell_ = 1;
  std::array<int, 3> size_{1, 1, 1};
  std::array<float, 3> top_{};
  std::vector<std::uint8_t> values_{std::uint8_t{most}};
};

DistanceTable::DistanceTable(const ClosestPointGrid& grid, double cut_off)
    : cell_(static_cast<float>(grid.cell())) {
  // One more voxel on each side: the margin.
  low_ = (grid.low() - Vector3d::Constant(grid.cell())).cast<float>();
  for (std::size_t i = 0; i < 3; ++i) {
    size_[i] = static_cast<int>(grid.size()[i]) + 2;
    top_[i] = static_cast<float>(size_[i] - 1);
  }
  const auto wide = [](int v) { return static_cast<std::size_t>(v); };
  const auto index_of = [&](int x, int y, int z) {
    return wide(x) + wide(size_[0]) * (wide(y) + wide(size_[1]) * wide(z));
  };
  values_.assign(index_of(0, 0, size_[2]), std::uint8_t{most});
  const double scale = most / cut_off;
  for (int z = 1; z + 1 < size_[2]; ++z) {
    for (int y = 1; y + 1 < size_[1]; ++y) {
      for (int x = 1; x + 1 < size_[0]; ++x) {
        const double distance = grid.distance_at(x - 1, y - 1, z - 1);
        values_[index_of(x, y, z)] =
            static_cast<std::uint8_t>(std::min<double>(most, std::lround(distance * scale)));
      }
    }
  }
}

constexpr double exact_rms = 0.001;            // of the length
constexpr double exact_max = 0.003;            // of the length: an outlier's distance
constexpr double exact_share = 0.002;          // maximum share of outliers
constexpr double near_rms = 0.04;              // of the length
constexpr double identity_angle = radians(4);  // a motion that turns less is the identity
constexpr double min_separation =
    radians(11);  // near symmetries, from each other and from exact ones

Pose about(const Vector3d& centre, const Quaterniond& rotation) {
  return {centre - rotation * centre, rotation};
}

/// The turn about `axis` in a rotation, rad (swing-twist decomposition).
double twist(const Quaterniond& rotation, const Vector3d& axis) {
  return 2 * std::atan2(rotation.vec().dot(axis), rotation.w());
}

class Measurement {
 public:
  Measurement(const Mesh& mesh, const VisibleSurface& surface, double length)
      : caster_(seen(mesh, surface)), length_(length) {
    for (const SurfaceSample& s : surface.samples) samples_.push_back(s.position.cast<double>());
  }

  const std::vector<Vector3d>& samples() const { return samples_; }

  /// Fills deviation and exactness, of the motion and of its inverse.
  void measure(Symmetry& s, std::size_t max_samples) const {
    const Pose back = s.motion.inverse();
    const std::size_t n = std::min(max_samples, samples_.size());
    double sum = 0;
    std::size_t off = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector3d& p = samples_[i * samples_.size() / n];
      for (const Vector3d& q : {s.motion * p, back * p}) {
        const double distance = (caster_.nearest(q) - q).norm();
        sum += distance * distance;
        if (distance > exact_max * length_) ++off;
      }
    }
    s.deviation_m = std::sqrt(sum / static_cast<double>(2 * n));
    s.exact = s.deviation_m < exact_rms * length_ &&
              static_cast<double>(off) <= exact_share * static_cast<double>(2 * n);
  }

 private:
  static Mesh seen(const Mesh& mesh, const VisibleSurface& surface) {
    Mesh result;
    result.vertices = mesh.vertices;
    for (const std::uint32_t t : surface.triangles) result.triangles.push_back(mesh.triangles[t]);
    return result;
  }

  RayCaster caster_;
  double length_;
  std::vector<Vector3d> samples_;
};

struct Turn {
  Quaterniond rotation;
  double score = 0;
};

/// Rotations with the smallest mean distance of the rotated surface from the surface, after
/// non-maximum suppression.
std::vector<Turn> candidate_rotations(const std::vector<Vector3d>& points, const Vector3d& centre,
                                      const DistanceTable& distances) {
  constexpr int directions = 400;  // 10 degrees apart
  constexpr int turns = 36;
  constexpr double max_angle = radians(9);
  constexpr std::size_t most = 300;
  std::vector<Turn> grid;
  for (const Vector3d& direction : spread_directions(directions)) {
    const Quaterniond to_axis = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), direction);
    for (int i = 0; i < turns; ++i) {
      const Quaterniond rotation = to_axis * rotation_from_vector({0, 0, radians(360) * i / turns});
      const Matrix3d matrix = rotation.toRotationMatrix();
      int sum = 0;
      for (const Vector3d& p : points) {
        sum += distances.value((matrix * (p - centre) + centre).cast<float>());
      }
      grid.push_back({rotation, static_cast<double>(sum)});
    }
  }
  std::stable_sort(grid.begin(), grid.end(),
                   [](const Turn& a, const Turn& b) { return a.score < b.score; });
  std::vector<Turn> best;
  for (const Turn& t : grid) {
    if (best.size() == most) break;
    const bool known = std::any_of(best.begin(), best.end(), [&](const Turn& other) {
      return t.rotation.angularDistance(other.rotation) < max_angle;
    });
    if (!known) best.push_back(t);
  }
  return best;
}

/// The point nearest to `centre` that a motion turns about. Of a screw the translation along the
/// axis is left over.
Vector3d fixed_point(const Pose& motion, const Vector3d& centre) {
  const Matrix3d moves = Matrix3d::Identity() - motion.rotation.toRotationMatrix();
  const Vector3d off = motion * centre - centre;
  return centre +
         moves.jacobiSvd(Eigen::ComputeFullU | Eigen::ComputeFullV).setThreshold(1e-3).solve(off);
}

/// An axis about which all sampled turns are exact, of one of the exact motions.
void find_axis_of_revolution(const Measurement& measurement, const std::vector<Symmetry>& found,
                             Symmetries& result) {
  constexpr double golden_angle = 2.399963229728653;
  constexpr int turns = 10;
  for (const Symmetry& candidate : found) {
    if (!candidate.exact) continue;
    const Vector3d axis = rotation_vector(candidate.motion.rotation).normalized();
    const Vector3d point = fixed_point(candidate.motion, result.centre);
    bool all = true;
    for (int i = 1; i <= turns && all; ++i) {
      Symmetry s;
      s.motion = about(point, rotation_from_vector(i * golden_angle * axis));
      measurement.measure(s, 500);
      all = s.exact;
    }
    if (!all) continue;
    result.revolution = true;
    result.axis = axis;
    result.centre = point;
    return;
  }
}

}  // namespace

int Symmetries::exact_count() const {
  return 1 + static_cast<int>(std::count_if(motions.begin(), motions.end(),
                                            [](const Symmetry& s) { return s.exact; }));
}

bool Symmetries::contains(const Pose& motion, double slack, bool equal) const {
  const auto leads = [&](const Pose& known) {
    // motion = known, or known composed with an exact symmetry
    Pose rest = known.inverse() * motion;
    if (equal) rest = nearest_equal(rest, {});
    Quaterniond turn = rest.rotation;
    if (revolution) turn = turn * rotation_from_vector(-twist(turn, axis) * axis);
    return turn.angularDistance(Quaterniond::Identity()) < slack;
  };
  return leads({}) || std::any_of(motions.begin(), motions.end(),
                                  [&](const Symmetry& s) { return leads(s.motion); });
}

Pose Symmetries::nearest_equal(const Pose& pose, const Pose& reference) const {
  const Quaterniond back = reference.rotation.conjugate();
  Pose best;
  double min_angle = std::numeric_limits<double>::infinity();
  const auto consider = [&](Pose equal) {
    if (revolution) {
      const double turn = -twist(back * equal.rotation, axis);
      equal = equal * about(centre, rotation_from_vector(turn * axis));
    }
    const double angle = equal.rotation.angularDistance(reference.rotation);
    if (angle < min_angle) {
      min_angle = angle;
      best = equal;
    }
  };
  consider(pose);
  for (const Symmetry& s : motions) {
    if (s.exact) consider(pose * s.motion);
  }
  return best;
}

double Symmetries::angle_between(const Pose& pose, const Pose& reference) const {
  return berth::angle_between(nearest_equal(pose, reference), reference);
}

double Symmetries::distance(const Pose& pose, const Pose& reference) const {
  return (nearest_equal(pose, reference) * centre - reference * centre).norm();
}

Symmetries measure_symmetries(const Mesh& mesh, const VisibleSurface& surface,
                              const ClosestPointGrid& grid, double length) {
  constexpr int max_near = 24;
  constexpr double cut_off = 0.1;  // of the length
  const DistanceTable distances(grid, cut_off * length);
  const Measurement measurement(mesh, surface, length);
  Symmetries result;
  for (const SurfaceSample& s : surface.samples) result.centre += s.position.cast<double>();
  result.centre /= static_cast<double>(surface.samples.size());

  std::vector<Vector3d> centred = sampled_evenly(measurement.samples(), 250);
  for (Vector3d& p : centred) p -= result.centre;
  std::vector<Symmetry> found;
  for (const Turn& turn :
       candidate_rotations(sampled_evenly(measurement.samples(), 100), result.centre, distances)) {
    const Pose laid = align_points(grid, centred, {result.centre, turn.rotation}, 0.05 * length,
                                   0.005 * length, 15);
    Symmetry s;
    s.motion = laid * Pose{-result.centre, Quaterniond::Identity()};
    if (s.motion.rotation.angularDistance(Quaterniond::Identity()) < identity_angle) continue;
    measurement.measure(s, 300);
    if (s.deviation_m < near_rms * length) found.push_back(s);
  }
  std::stable_sort(found.begin(), found.end(), [](const Symmetry& a, const Symmetry& b) {
    return a.deviation_m < b.deviation_m;
  });
  find_axis_of_revolution(measurement, found, result);
  // First those that are exact, then near ones, once for all the poses that an exact one makes
  // equal. Neighbours of a better one are skipped.
  for (Symmetry& s : found) {
    if (!s.exact) continue;
    measurement.measure(s, 4000);
    if (s.exact && !result.contains(s.motion, identity_angle, false)) result.motions.push_back(s);
  }
  int near = 0;
  for (Symmetry& s : found) {
    if (near == max_near || result.contains(s.motion, min_separation, true)) continue;
    measurement.measure(s, 2000);
    s.exact = false;
    result.motions.push_back(s);
    ++near;
  }
  return result;
}

}  // namespace berth::estimator
