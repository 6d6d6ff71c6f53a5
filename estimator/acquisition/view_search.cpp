// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/view_search.h"

#include <algorithm>
#include <cmath>

#include "estimator/model/point_fit.h"

namespace berth::estimator {

namespace {

/// One view at one turn and shift, and the sum of distances.
struct Guess {
  int cost;
  std::uint16_t view, turn, shift;
};

/// Coordinates one axis after the other, so that the compiler makes vector code of the loops.
struct Columns {
  std::vector<float> x, y, z;
  std::vector<int> index;

  void assign(const std::vector<Vector3d>& points, const Matrix3d& rotation,
              const Vector3d& centroid) {
    x.resize(points.size());
    y.resize(points.size());
    z.resize(points.size());
    index.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3f p = (rotation * (points[i] - centroid)).cast<float>();
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
  }

  /// Sum of the distances of the points moved by m * p + t, in voxels.
  int cost(const DistanceTable& table, const Eigen::Matrix3f& m, const Eigen::Vector3f& t) {
    const float m00 = m(0, 0), m01 = m(0, 1), m02 = m(0, 2);
    const float m10 = m(1, 0), m11 = m(1, 1), m12 = m(1, 2);
    const float m20 = m(2, 0), m21 = m(2, 1), m22 = m(2, 2);
    const float tx = t.x(), ty = t.y(), tz = t.z();
    const std::size_t n = x.size();
    const float* px = x.data();
    const float* py = y.data();
    const float* pz = z.data();
    int* to = index.data();
    for (std::size_t i = 0; i < n; ++i) {
      to[i] = table.index(m00 * px[i] + m01 * py[i] + m02 * pz[i] + tx,
                          m10 * px[i] + m11 * py[i] + m12 * pz[i] + ty,
                          m20 * px[i] + m21 * py[i] + m22 * pz[i] + tz);
    }
    int sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += table.value(to[i]);
    return sum;
  }
};

/// Every view, turn and shift against a set of points.
class Scoring {
 public:
  Scoring(const TargetModel& model, const Vector3d& centroid, const std::vector<Vector3d>& shifts,
          int turns)
      : model_(model), centroid_(centroid), shifts_(shifts), turns_(turns) {
    // From sensor axes to those of a viewer who looks along the line of sight.
    to_sight_ = Quaterniond::FromTwoVectors(centroid, Vector3d::UnitZ());
    const auto cell = 1 / static_cast<double>(model.distances.cell());
    const Vector3d low = model.distances.low().cast<double>();
    const double nearness = model.radius / centroid.norm();
    for (const View& view : model.views) {
      const Vector3d seen = view.centroid(nearness);
      const Vector3d viewer = model.centre + centroid.norm() * view.direction;
      const Quaterniond back = towards_viewer((viewer - seen).normalized()).conjugate();
      placed_.push_back({seen, back, (cell * back.toRotationMatrix()).cast<float>(), {}});
      for (const Vector3d& shift : shifts) {
        placed_.back().offsets.emplace_back((cell * (seen - back * shift - low)).cast<float>());
      }
    }
  }

  Quaterniond turn(int i) const { return rotation_from_vector({0, 0, radians(360) * i / turns_}); }
  Columns columns(const std::vector<Vector3d>& points, int i) const {
    Columns result;
    result.assign(points, (turn(i).conjugate() * to_sight_).toRotationMatrix(), centroid_);
    return result;
  }
  int cost(Columns& columns, std::size_t view, std::size_t shift) const {
    return columns.cost(model_.distances, placed_[view].rotation, placed_[view].offsets[shift]);
  }
  /// T_model_cloud: of the points about their centroid, axes as the sensor's.
  Pose to_model(const Guess& guess) const {
    const Placed& view = placed_[guess.view];
    return {view.centroid - view.back * shifts_[guess.shift],
            view.back * turn(guess.turn).conjugate() * to_sight_};
  }
  std::size_t views() const { return placed_.size(); }
  std::size_t shifts() const { return shifts_.size(); }

 private:
  struct Placed {
    Vector3d centroid;                     // that should be seen, model frame
    Quaterniond back;                      // from the viewer's axes to the model's
    Eigen::Matrix3f rotation;              // the same, in voxels
    std::vector<Eigen::Vector3f> offsets;  // for each shift, in voxels
  };

  const TargetModel& model_;
  Vector3d centroid_;
  const std::vector<Vector3d>& shifts_;
  int turns_;
  Quaterniond to_sight_;
  std::vector<Placed> placed_;
};

void keep_best(std::vector<Guess>& guesses, int count) {
  const auto order = [](const Guess& a, const Guess& b) {
    return std::tie(a.cost, a.view, a.turn, a.shift) < std::tie(b.cost, b.view, b.turn, b.shift);
  };
  const auto n = std::min(guesses.size(), static_cast<std::size_t>(count));
  const auto end = guesses.begin() + static_cast<std::ptrdiff_t>(n);
  std::nth_element(guesses.begin(), end, guesses.end(), order);
  guesses.erase(end, guesses.end());
  std::sort(guesses.begin(), guesses.end(), order);
}

}  // namespace

std::vector<Candidate> search_views(const TargetModel& model, const std::vector<Vector3d>& points,
                                    const Vector3d& centroid, const std::vector<Vector3d>& shifts,
                                    const ViewSearchOptions& options) {
  if (points.empty()) return {};
  const Scoring search(model, centroid, shifts, options.turns);
  const std::vector<Vector3d> few = [&] {
    std::vector<Vector3d> result;
    const auto n = std::min(points.size(), static_cast<std::size_t>(options.first_points));
    for (std::size_t i = 0; i < n; ++i) {
      result.push_back(points[(2 * i + 1) * points.size() / (2 * n)]);
    }
    return result;
  }();

  std::vector<Guess> guesses;
  guesses.reserve(search.views() * search.shifts() * static_cast<std::size_t>(options.turns));
  for (int turn = 0; turn < options.turns; ++turn) {
    Columns columns = search.columns(few, turn);
    for (std::size_t view = 0; view < search.views(); ++view) {
      for (std::size_t shift = 0; shift < search.shifts(); ++shift) {
        guesses.push_back({search.cost(columns, view, shift), static_cast<std::uint16_t>(view),
                           static_cast<std::uint16_t>(turn), static_cast<std::uint16_t>(shift)});
      }
    }
  }
  keep_best(guesses, options.shortlist);
  std::vector<Columns> all;
  for (int turn = 0; turn < options.turns; ++turn) all.push_back(search.columns(points, turn));
  for (Guess& g : guesses) g.cost = search.cost(all[g.turn], g.view, g.shift);
  keep_best(guesses, options.shortlist);

  // The best of each neighbourhood.
  std::vector<Pose> starts;
  const double beside = 1 - 0.5 * std::pow(0.5 * radians(13), 2);  // cosine of half the angle
  const double close = 0.04 * model.target.length;
  for (const Guess& g : guesses) {
    if (starts.size() == static_cast<std::size_t>(options.laid)) break;
    const Pose pose = search.to_model(g);
    const bool known = std::any_of(starts.begin(), starts.end(), [&](const Pose& other) {
      return std::abs(pose.rotation.dot(other.rotation)) > beside &&
             (pose.position - other.position).norm() < close;
    });
    if (!known) starts.push_back(pose);
  }

  std::vector<Vector3d> centred = points;
  for (Vector3d& p : centred) p -= centroid;
  const double unit = model.distances.cut_off() / DistanceTable::most;
  std::vector<Candidate> result;
  for (const Pose& start : starts) {
    const Pose laid = lay_points(model.grid, centred, start, 0.06 * model.target.length,
                                 0.015 * model.target.length, options.iterations);
    double sum = 0;
    for (const Vector3d& p : centred) sum += model.distances.value((laid * p).cast<float>());
    const Pose to_model = laid * Pose{-centroid, Quaterniond::Identity()};
    result.push_back({to_model.inverse(), unit * sum / static_cast<double>(points.size())});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  return result;
}

}  // namespace berth::estimator
