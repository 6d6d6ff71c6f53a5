// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/long_range.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace berth::estimator {
namespace {

constexpr int min_returns = 3;
// Half of the views' spacing.
constexpr double view_spacing = radians(9);
constexpr double unknown_rotation = radians(180);

/// Turns a into b, both unit, by the shorter way.
Quaterniond turn_between(const Vector3d& a, const Vector3d& b) {
  return Quaterniond::FromTwoVectors(a, b);
}

/// Coordinates by axis, for vectorised loops.
class PointColumns {
 public:
  explicit PointColumns(const std::vector<Vector3d>& points) {
    for (std::vector<double>* column : {&x_, &y_, &z_}) column->reserve(points.size());
    for (const Vector3d& p : points) {
      x_.push_back(p.x());
      y_.push_back(p.y());
      z_.push_back(p.z());
    }
  }

  std::int64_t count_near(const Vector3d& centre, double reach) const {
    const double x = centre.x();
    const double y = centre.y();
    const double z = centre.z();
    const double reach2 = reach * reach;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double dx = x_[i] - x;
      const double dy = y_[i] - y;
      const double dz = z_[i] - z;
      count += dx * dx + dy * dy + dz * dz < reach2 ? 1 : 0;
    }
    return count;
  }

 private:
  std::vector<double> x_, y_, z_;
};

/// Of all view directions from which anything is visible; samples are weighted by their projected
/// area.
std::vector<ViewMoments> view_moments(const TargetModel& model) {
  std::vector<ViewMoments> views;
  for (int i = 0; i < direction_count; ++i) {
    ViewMoments view;
    view.to_viewer = view_directions()[static_cast<std::size_t>(i)];
    double sum = 0;
    Matrix3d second = Matrix3d::Zero();
    for (const SurfaceSample& s : model.surface.samples) {
      if (!s.visible_from.contains(i)) continue;
      const double weight = std::abs(s.normal.cast<double>().dot(view.to_viewer));
      const Vector3d p = s.position.cast<double>();
      view.centroid += weight * p;
      second += weight * p * p.transpose();
      sum += weight;
    }
    if (sum <= 0) continue;
    view.centroid /= sum;
    view.scatter = second / sum - view.centroid * view.centroid.transpose();
    views.push_back(view);
  }
  return views;
}

}  // namespace

LongRange::LongRange(const TargetModel& model, const BeamModel& beam_model, int axis_returns)
    : model_(model),
      beam_model_(beam_model),
      axis_returns_(axis_returns),
      views_(view_moments(model)) {}

LongRangeFix LongRange::find(const PreprocessedScan& scan) const {
  LongRangeFix none;
  if (scan.points.empty()) {
    none.reason = "no returns inside the range gate";
    return none;
  }
  // The return with the most neighbours within the target's size.
  constexpr std::size_t max_centres = 300;
  const std::size_t stride = 1 + scan.points.size() / max_centres;
  const double reach = 2 * model_.radius;
  const auto all = static_cast<std::int64_t>(scan.points.size());
  const PointColumns columns(scan.points);
  std::size_t best = 0;
  std::int64_t max_near = 0;
  for (std::size_t i = 0; i < scan.points.size() && max_near < all; i += stride) {
    const std::int64_t near = columns.count_near(scan.points[i], reach);
    if (near > max_near) {
      max_near = near;
      best = i;
    }
  }
  std::vector<Vector3d> returns;
  for (const Vector3d& p : scan.points) {
    if ((p - scan.points[best]).norm() < reach) returns.push_back(p);
  }
  return fix(returns, nullptr);
}

LongRangeFix LongRange::track(const PreprocessedScan& scan, const Prediction& predicted) const {
  const double sigma = std::sqrt(predicted.covariance.diagonal().head<3>().maxCoeff());
  const Vector3d centre = predicted.pose.position;
  const double reach = model_.radius + (model_.centre).norm() + 4 * sigma;
  std::vector<Vector3d> returns;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const std::int64_t utime = scan.beams[scan.beam_of_point[i]].utime;
    const double late = static_cast<double>(utime - scan.utime_mean) * 1e-6;
    const Vector3d p = scan.points[i] - late * predicted.velocity.linear;
    if ((p - centre).norm() < reach) returns.push_back(p);
  }
  return fix(returns, &predicted);
}

std::vector<LongRange::Attitude> LongRange::attitudes(const Vector3d& line_of_sight,
                                                      const Matrix3d& scatter, int count,
                                                      double range,
                                                      const Prediction* predicted) const {
  constexpr int rolls = 12;
  const bool moments = count >= axis_returns_;
  const double along = beam_model_.range_sigma_m;
  const double across =
      range * std::hypot(beam_model_.azimuth_sigma_rad, 0.25 * beam_model_.divergence_rad);
  Matrix3d noise = across * across * Matrix3d::Identity();
  noise += (along * along - across * across) * line_of_sight * line_of_sight.transpose();
  Matrix6d prior = Matrix6d::Zero();
  bool has_prior = false;
  if (predicted != nullptr) {
    const double sigma = std::sqrt(predicted->covariance.diagonal().tail<3>().maxCoeff());
    has_prior = sigma < 0.5;
    prior = predicted->covariance;
  }
  Matrix3d prior_information = Matrix3d::Zero();
  if (has_prior) {
    const Matrix3d wide =
        prior.bottomRightCorner<3, 3>() + view_spacing * view_spacing * Matrix3d::Identity();
    prior_information = wide.inverse();
  }

  std::vector<Attitude> result;
  double best = -std::numeric_limits<double>::infinity();
  for (const ViewMoments& view : views_) {
    const Quaterniond facing = turn_between(view.to_viewer, -line_of_sight);
    for (int k = 0; k < rolls; ++k) {
      const Eigen::AngleAxisd roll(radians(360.0) * k / rolls, line_of_sight);
      Attitude a{(Quaterniond(roll) * facing).normalized(), {}, 0};
      const Matrix3d rotation = a.rotation.toRotationMatrix();
      a.centroid = rotation * view.centroid;
      if (moments) {
        const Matrix3d expected = rotation * view.scatter * rotation.transpose() + noise;
        // The discretisation of views and rolls changes the moments by about a tenth.
        const double coarse = 0.1 * expected.trace();
        for (int i = 0; i < 3; ++i) {
          for (int j = i; j < 3; ++j) {
            const double off = scatter(i, j) - expected(i, j);
            const double variance =
                (expected(i, i) * expected(j, j) + expected(i, j) * expected(i, j)) / count +
                coarse * coarse;
            a.weight -= 0.5 * off * off / variance;
          }
        }
      }
      if (has_prior) {
        const Vector3d away = rotation_vector(a.rotation * predicted->pose.rotation.conjugate());
        a.weight -= 0.5 * away.dot(prior_information * away);
      }
      best = std::max(best, a.weight);
      result.push_back(a);
    }
  }
  double sum = 0;
  for (Attitude& a : result) sum += a.weight = std::exp(a.weight - best);
  for (Attitude& a : result) a.weight /= sum;
  return result;
}

LongRangeFix LongRange::fix(const std::vector<Vector3d>& returns,
                            const Prediction* predicted) const {
  LongRangeFix result;
  result.used = static_cast<int>(returns.size());
  const double n = std::max(1, result.used);
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : returns) mean += p / n;
  result.pose.position = mean;
  if (result.used < min_returns) {
    result.reason = std::to_string(result.used) + " returns where the target should be, at least " +
                    std::to_string(min_returns) + " are needed";
    return result;
  }
  Matrix3d scatter = Matrix3d::Zero();
  for (const Vector3d& p : returns) scatter += (p - mean) * (p - mean).transpose() / n;
  const double range = mean.norm();
  result.axis = result.used >= axis_returns_;

  const std::vector<Attitude> all = attitudes(mean / range, scatter, result.used, range, predicted);
  Vector3d offset = Vector3d::Zero();  // from the model's origin to the centroid
  const Attitude* best = &all.front();
  for (const Attitude& a : all) {
    offset += a.weight * a.centroid;
    if (a.weight > best->weight) best = &a;
  }
  result.pose = {mean - offset, best->rotation};
  // Of attitudes of comparable weight the nearest to the prediction: no flips.
  if (predicted != nullptr) {
    constexpr double nearly = 0.3;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Attitude& a : all) {
      const double away = a.rotation.angularDistance(predicted->pose.rotation);
      if (a.weight < nearly * best->weight || away >= nearest) continue;
      nearest = away;
      result.pose.rotation = a.rotation;
    }
    if (!result.axis) result.pose.rotation = predicted->pose.rotation;
  }
  Vector6d spread;
  for (const Attitude& a : all) {
    spread.head<3>() = offset - a.centroid;
    spread.tail<3>() = rotation_vector(a.rotation * result.pose.rotation.conjugate());
    result.systematic += a.weight * spread * spread.transpose();
  }
  result.systematic.diagonal().tail<3>().array() += view_spacing * view_spacing;

  // Covariance of the mean of randomly placed returns.
  const double variance =
      beam_model_.range_variance(range, 0) +
      std::pow(range * std::max(beam_model_.azimuth_sigma_rad, beam_model_.divergence_rad), 2);
  result.covariance.setZero();
  result.covariance.topLeftCorner<3, 3>() = (scatter + variance * Matrix3d::Identity()) / n;
  result.covariance.bottomRightCorner<3, 3>() =
      unknown_rotation * unknown_rotation * Matrix3d::Identity();
  result.ok = true;
  return result;
}

}  // namespace berth::estimator
