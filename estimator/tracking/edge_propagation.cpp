// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_propagation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>

#include "estimator/tracking/beam_groups.h"
#include "estimator/tracking/beams_near.h"
#include "estimator/tracking/edge_moments.h"
#include "estimator/tracking/edge_nodes.h"
#include "estimator/tracking/motion_prior.h"
#include "estimator/tracking/moving_frame.h"

namespace berth::estimator {

namespace {

constexpr std::size_t first_beams = 16;  // of the first group, about
constexpr std::size_t both_kinds = 4;    // returns, and beams of the outline, over returns, about

constexpr double same_plane = 0.1;  // range sigmas

/// Rays that draw a beam where its own angle noise does most of it.
constexpr std::size_t blurred_nodes = 32;
constexpr std::size_t blurred_nodes_at_last = 64;

/// Elsewhere. Where few returns tell all, what is drawn coarsely is accuracy lost; where
/// there are many, they make up for each other.
std::size_t nodes_of_beam(std::size_t returns) {
  constexpr std::size_t of_all = 20000;  // together, about
  constexpr std::size_t least = 16;
  constexpr std::size_t most = 64;
  return std::clamp(std::bit_floor(of_all / std::max<std::size_t>(returns, 1)), least, most);
}

/// Axes of a beam: right, up, along it; sensor frame. They turn with the target, so that what is
/// found does, too.
Matrix3d axes_of(const Vector3d& direction, const Pose& pose) {
  Vector3d up = pose.rotation * Vector3d::UnitZ();
  if (std::abs(up.dot(direction)) > 0.9) up = pose.rotation * Vector3d::UnitX();
  Matrix3d axes;
  axes.col(0) = up.cross(direction).normalized();
  axes.col(1) = axes.col(0).cross(direction);
  axes.col(2) = direction;
  return axes;
}

/// Covariance of a beam's angle noise along its axes, rad^2.
Eigen::Matrix2d angle_noise(const Matrix3d& axes, const BeamModel& beam_model) {
  const Vector3d d = axes.col(2);
  const double level = std::max(1e-9, std::hypot(d.x(), d.z()));
  const Vector3d azimuth(d.z(), 0, -d.x());  // change of the direction with it
  const Vector3d elevation = azimuth.cross(d) / level;
  const auto across = axes.leftCols<2>();
  const Eigen::Vector2d right = beam_model.azimuth_sigma_rad * (across.transpose() * azimuth);
  const Eigen::Vector2d up = beam_model.elevation_sigma_rad * (across.transpose() * elevation);
  return right * right.transpose() + up * up.transpose();
}

/// Covariance of the pose so many seconds after the reference.
Matrix6d pose_after(double time, const Matrix12d& covariance) {
  return covariance.topLeftCorner<6, 6>() +
         time * (covariance.topRightCorner<6, 6>() + covariance.bottomLeftCorner<6, 6>()) +
         time * time * covariance.bottomRightCorner<6, 6>();
}

/// Along what all together would make less certain than it is, edges say nothing.
void never_less_than_nothing(MotionInformation& sum, const Matrix12d& covariance) {
  constexpr double little = 1e-6;  // rounding
  const bool velocity_known = covariance.bottomRightCorner<6, 6>().isZero(0);
  const Eigen::Index size = velocity_known ? 6 : 12;
  const MotionMatrix root = MotionMatrix(covariance.topLeftCorner(size, size)).llt().matrixL();
  const MotionMatrix share = root.transpose() * sum.information.topLeftCorner(size, size) * root;
  if (MotionMatrix(share + little * MotionMatrix::Identity(size, size)).ldlt().isPositive()) return;
  const Eigen::SelfAdjointEigenSolver<MotionMatrix> eigen(share);
  const MotionMatrix kept = eigen.eigenvectors() *
                            (eigen.eigenvalues().array() > 0).cast<double>().matrix().asDiagonal() *
                            eigen.eigenvectors().transpose();
  const MotionMatrix unroot =
      root.triangularView<Eigen::Lower>().solve(MotionMatrix::Identity(size, size));
  sum.information.topLeftCorner(size, size) = unroot.transpose() * kept * share * kept * unroot;
  sum.gradient.head(size) = unroot.transpose() * kept * root.transpose() * sum.gradient.head(size);
}

}  // namespace

EdgePropagation::EdgePropagation(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const std::vector<MetFace>& returns,
                                 const Outline& outline, int certain_returns,
                                 const BeamInformationOptions& options)
    : model_(model),
      beam_model_(beam_model),
      beams_(beams),
      returns_(returns),
      outline_(outline),
      certain_returns_(certain_returns),
      options_(options),
      nodes_(nodes_of_beam(static_cast<std::size_t>(certain_returns) + returns.size())),
      groups_(std::bit_width(both_kinds * returns.size() / first_beams + 1)),
      waiting_(groups_) {}

std::vector<MetFace> EdgePropagation::returns_left() const {
  std::vector<MetFace> left;
  std::copy_if(returns_.begin(), returns_.end(), std::back_inserter(left),
               [this](const MetFace& met) { return group_of(met.beam, groups_) < waiting_; });
  return left;
}

bool EdgePropagation::blurred(const BeamLinearisation& at) const {
  return angles_blur_edges(beam_model_, (at.pose * model_.centre).norm());
}

/// How far from a beam its nodes lie at the target, at most, m.
double EdgePropagation::reach_of(const BeamLinearisation& at, const Matrix12d& covariance) const {
  const Vector3d centre = at.pose * model_.centre;
  Lever lever;
  lever << Matrix3d::Identity(), -skew(centre - at.pose.position);
  const Matrix6d pose = covariance.topLeftCorner<6, 6>();
  const double angle = std::hypot(beam_model_.azimuth_sigma_rad, beam_model_.elevation_sigma_rad);
  const double variance = (lever * pose * lever.transpose()).trace() +
                          model_.radius * model_.radius * pose.diagonal().tail<3>().sum() +
                          angle * angle * centre.squaredNorm();
  return 2 * std::sqrt(variance);
}

MotionInformation EdgePropagation::take(const BeamLinearisation& at, const Matrix12d& covariance) {
  MovingFrame frame(at);
  const std::size_t nodes = blurred(at) ? blurred_nodes : nodes_;
  const auto look_at = [&](std::uint32_t beam) {
    Site site;
    site.beam = beam;
    const bool tells = renew(site, at, frame, covariance, nodes);
    if (site.meets) {
      ++meet_;
      if (!beams_[beam].hit()) ++lost_;
    }
    if (!tells) return;
    if (site.final) {
      add(site, certain_);
    } else {
      sites_.push_back(site);
    }
  };
  --waiting_;
  for (const MetFace& met : returns_) {
    if (group_of(met.beam, groups_) != waiting_) continue;
    look_at(met.beam);
    ++taken_;
  }
  const BeamPicks passed = outline_.group(waiting_, groups_);
  taken_ += passed.size();
  const double reach = reach_of(at, covariance);
  for (const std::uint32_t beam : beams_near(model_, beams_, passed, at, reach)) look_at(beam);
  return sum(covariance);
}

/// Of the beams on the target: what is supposed counts as one lost beam. Taken for greater than it
/// is, it would let the target seem larger: what passes it would be lost beams.
double EdgePropagation::drop_out() const {
  const double others = certain_returns_ / all_over_taken();
  return (1 + lost_) / (1 / options_.likelihood.drop_out + meet_ + others);
}

MotionInformation EdgePropagation::sweep(const BeamLinearisation& at, const Matrix12d& covariance) {
  MovingFrame frame(at);
  const std::size_t nodes = blurred(at) ? blurred_nodes_at_last : nodes_;
  std::erase_if(sites_, [&](Site& site) {
    if (!renew(site, at, frame, covariance, nodes)) return true;
    if (site.final) add(site, certain_);
    return site.final;
  });
  return sum(covariance);
}

void EdgePropagation::add(const Site& site, MotionInformation& sum) const {
  const Eigen::Matrix<double, 6, 3> weighted = site.lever.transpose() * site.precision;
  const Matrix6d information = weighted * site.lever;
  const Vector6d gradient = site.lever.transpose() * site.shift;
  ++sum.returns;
  sum.information.topLeftCorner<6, 6>() += information;
  sum.gradient.head<6>() += gradient;
  if (!options_.of_velocity) return;
  const double t = site.time;
  sum.information.topRightCorner<6, 6>() += t * information;
  sum.information.bottomLeftCorner<6, 6>() += t * information;
  sum.information.bottomRightCorner<6, 6>() += t * t * information;
  sum.gradient.tail<6>() += t * gradient;
}

MotionInformation EdgePropagation::sum(const Matrix12d& covariance) const {
  MotionInformation sum = certain_;
  for (const Site& site : sites_) add(site, sum);
  never_less_than_nothing(sum, covariance);
  return sum;
}

void EdgePropagation::moved(const Vector12d& step) {
  certain_.gradient -= certain_.information * step;
  for (Site& site : sites_) {
    const Vector6d then = step.head<6>() + site.time * step.tail<6>();
    site.shift -= site.precision * (site.lever * then);
  }
}

/// The view of a beam that goes along these axes, but for the cavity.
void EdgePropagation::look_along(const Beam& beam, const Matrix3d& axes, const MovingFrame& frame) {
  const double sigma = beam.range_sigma > 0 ? beam.range_sigma : beam_model_.range_sigma_m;
  view_.beam = &beam;
  view_.axes = frame.turn() * axes;
  view_.eye = frame.eye();
  view_.angle = angle_noise(axes, beam_model_);
  view_.range_variance = sigma * sigma + options_.model_sigma_m * options_.model_sigma_m;
}

/// @return whether any node meets the target.
bool EdgePropagation::cast(const Site& site, std::size_t nodes) {
  const double far = (model_.centre - view_.eye).norm() + 1.01 * model_.radius;
  return view_.cast(model_.caster, far, site.range, edge_nodes(site.beam, nodes));
}

/// @return whether the beam has anything to say.
bool EdgePropagation::renew(Site& site, const BeamLinearisation& at, MovingFrame& frame,
                            const Matrix12d& covariance, std::size_t nodes) {
  const Beam& beam = beams_[site.beam];
  site.time = frame.go_to(beam);
  const Matrix3d axes = axes_of(beam.direction, at.pose);
  const Vector3d origin = at.pose.position + site.time * at.velocity.linear;
  const auto reach_to = [&](double range) {
    site.range = range;
    site.lever << axes.transpose(), -axes.transpose() * skew(range * beam.direction - origin);
  };
  // What is met behind the target has nothing to do with where its edge is.
  const double middle = (at.pose * model_.centre).norm();
  if (site.range == 0) {
    reach_to(std::abs(beam.range - middle) < model_.radius ? beam.range : middle);
  }
  look_along(beam, axes, frame);
  const Matrix6d pose =
      options_.of_velocity ? pose_after(site.time, covariance) : covariance.topLeftCorner<6, 6>();
  Matrix3d here;
  constexpr double least_variance = 1e-10;  // m^2; never flat, for rounding
  for (bool first = true;; first = false) {
    here = site.lever * pose * site.lever.transpose() + least_variance * Matrix3d::Identity();
    leave_out(site, here);
    if (!cast(site, nodes)) return false;
    const double nearest = view_.nearest();
    const bool close = std::abs(nearest - site.range) < 0.01 * nearest;
    // Not to where it was measured: a lever that has its noise pulls to one side.
    reach_to(nearest);
    if (!first || close) break;
  }
  site.meets = view_.meets();
  if (view_.one_plane(same_plane * beam_model_.range_sigma_m)) {
    site.final = true;
    return rest_on_face(site, here);
  }
  EdgeMoments told = moments();
  // What few nodes stand for, such as a panel's narrow side, few draw too coarsely.
  constexpr double few = 0.25;
  constexpr std::size_t finer = 4;
  if (told.nodes < few * static_cast<double>(nodes)) {
    if (!cast(site, std::min(finer * nodes, edge_nodes_at_most))) return false;
    told = moments();
  }
  match(site, told);
  return true;
}

EdgeMoments EdgePropagation::moments() const {
  LikelihoodOptions shares = options_.likelihood;
  shares.drop_out = drop_out();
  return edge_moments(view_, shares, options_.least_cosine);
}

/// The cavity.
void EdgePropagation::leave_out(const Site& site, const Matrix3d& here) {
  view_.cavity = here;
  view_.mean.setZero();
  if (site.precision.isZero(0)) return;
  constexpr double least_left = 0.02;  // of the variance; this beam may be all that holds it
  const Matrix3d root = here.llt().matrixL();
  const Matrix3d left = Matrix3d::Identity() - root.transpose() * site.precision * root;
  Eigen::SelfAdjointEigenSolver<Matrix3d> eigen;
  eigen.computeDirect(left);
  const Matrix3d turned = root * eigen.eigenvectors();
  view_.cavity = turned * eigen.eigenvalues().cwiseMax(least_left).cwiseInverse().asDiagonal() *
                 turned.transpose();
  view_.mean = -view_.cavity * site.shift;
}

/// The row that it would be far from edges. @return whether its return fits.
bool EdgePropagation::rest_on_face(Site& site, const Matrix3d& here) const {
  if (!view_.beam->hit()) return false;
  const Vector3d& facing = view_.hits[0].normal;
  const Vector3d normal = view_.axes.transpose() * facing;
  const double cosine = -normal.z();
  if (cosine < options_.least_cosine) return false;
  const double range = -view_.hits[0].range * facing.dot(view_.rays[0].direction) / cosine;
  const double variance = cosine * cosine * view_.range_variance +
                          range * range * normal.head<2>().dot(view_.angle * normal.head<2>());
  const double residual = cosine * (range - view_.beam->range);
  const double gate2 = options_.gate_sigmas * options_.gate_sigmas;
  if (residual * residual > gate2 * (variance + normal.dot(here * normal))) return false;
  site.precision = normal * normal.transpose() / variance;
  site.shift = normal * (residual / variance);
  return true;
}

/// The site is what the beam adds.
void EdgePropagation::match(Site& site, const EdgeMoments& told) const {
  // One that surprises may take away: were that left out, all together would know more than they
  // can.
  constexpr double most_taken = 0.1;
  const Matrix3d root = view_.cavity.llt().matrixL();
  const Matrix3d unroot = root.triangularView<Eigen::Lower>().solve(Matrix3d::Identity());
  const Matrix3d left = unroot * told.covariance * unroot.transpose();
  Eigen::SelfAdjointEigenSolver<Matrix3d> eigen;
  eigen.computeDirect(left);
  const Vector3d added = (eigen.eigenvalues().cwiseMax(1e-3).cwiseInverse().array() - 1)
                             .cwiseMax(-most_taken)
                             .matrix();
  const Matrix3d turned = unroot.transpose() * eigen.eigenvectors();
  site.precision = turned * added.asDiagonal() * turned.transpose();
  site.shift =
      site.precision * (view_.mean + told.mean) + unroot.transpose() * (unroot * told.mean);
}

}  // namespace berth::estimator
