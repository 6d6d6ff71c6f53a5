// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_information.h"

#include <algorithm>
#include <cmath>

#include "estimator/model/normal_sums.h"
#include "estimator/tracking/beam_nodes.h"

namespace berth::estimator {

namespace {

constexpr std::size_t chunk = 64;  // beams at a time, on the stack

Matrix6d both(const Matrix3d& rotation) {
  Matrix6d m = Matrix6d::Zero();
  m.topLeftCorner<3, 3>() = rotation;
  m.bottomRightCorner<3, 3>() = rotation;
  return m;
}

/// The sensor seen from the model as it moves.
class MovingFrame {
 public:
  explicit MovingFrame(const BeamLinearisation& at)
      : at_(at), rate_(at.velocity.angular.norm()), moves_(rate_ > 0 || speed2(at) > 0) {
    turn_ = start_ = at.pose.rotation.conjugate().toRotationMatrix();
    if (rate_ > 0) {
      const Matrix3d axis = skew(at.velocity.angular / rate_);
      sine_ = start_ * axis;
      versine_ = sine_ * axis;
    }
    eye_ = turn_ * -at.pose.position;
  }

  const Matrix3d& turn() const { return turn_; }  ///< sensor to model
  const Vector3d& eye() const { return eye_; }    ///< origin of the sensor, model frame

  /// @return seconds after the reference time.
  double go_to(const Beam& beam) {
    const double time = static_cast<double>(beam.utime - at_.utime) * 1e-6;
    if (!moves_) return time;
    if (rate_ > 0) {  // Rodrigues
      const double angle = rate_ * time;
      turn_ = start_ - std::sin(angle) * sine_ + (1 - std::cos(angle)) * versine_;
    }
    eye_ = turn_ * (-at_.pose.position - time * at_.velocity.linear);
    return time;
  }

 private:
  static double speed2(const BeamLinearisation& at) { return at.velocity.linear.squaredNorm(); }

  const BeamLinearisation& at_;
  double rate_;
  bool moves_;
  Matrix3d start_;
  Matrix3d sine_ = Matrix3d::Zero();
  Matrix3d versine_ = Matrix3d::Zero();
  Matrix3d turn_;
  Vector3d eye_;
};

class Accumulator {
 public:
  Accumulator(const TargetModel& model, const BeamModel& beam_model, const BeamLinearisation& at,
              const BeamInformationOptions& options)
      : model_(model),
        beam_model_(beam_model),
        options_(options),
        at_(at),
        frame_(at),
        sums_(options.of_velocity) {
    const double az = beam_model.azimuth_sigma_rad;
    const double el = beam_model.elevation_sigma_rad;
    angle_variance_ = 0.5 * (az * az + el * el);
    model_variance_ = options.model_sigma_m * options.model_sigma_m;
    gate2_ = options.gate_sigmas * options.gate_sigmas;
    const LikelihoodOptions& shares = options.likelihood;
    past_cost_ =
        std::max(0.0, gate2_ - 2 * std::log(std::max(1.0, shares.background / shares.outlier)));
    const Matrix6d turn = both(frame_.turn());
    covariance_ = turn * at.covariance * turn.transpose();
    certain_ = at.covariance.isZero(0);
    // The pose may be off across the beams by as much as at the target's centre.
    const Vector3d centre = at.pose * model.centre;
    Eigen::Matrix<double, 3, 6> lever;
    lever << Matrix3d::Identity(), -skew(centre - at.pose.position);
    const double extra2 =
        (lever * at.covariance * lever.transpose()).trace() / 3 / centre.squaredNorm();
    arm_right_ = std::sqrt(3.0 * (az * az + extra2));
    arm_up_ = std::sqrt(3.0 * (el * el + extra2));
    edge_reach_ = 2.5 * std::sqrt(angle_variance_ + extra2);
  }

  /// beam(i): the i-th of `total`.
  template <class BeamAt>
  BeamInformation run(std::size_t total, const BeamAt& beam) {
    for (std::size_t i = 0; i < total;) {
      std::size_t count = 0;
      for (; count < chunk && i < total; ++i) {
        const Beam& next = beam(i);
        if (options_.misses || next.hit()) batch_[count++] = &next;
      }
      take(count);
    }
    sums_.flush();
    const Matrix6d back = both(at_.pose.rotation.toRotationMatrix());
    for (std::size_t k = 0; k < 3; ++k) {
      const Matrix6d a = back * sums_.products(k) * back.transpose();
      result_.information[k] = 0.5 * (a + a.transpose());
      if (k < 2) result_.gradient[k] = back * sums_.residuals(k);
    }
    return result_;
  }

 private:
  double range_variance(const Beam& beam) const {
    const double sigma = beam.range_sigma > 0 ? beam.range_sigma : beam_model_.range_sigma_m;
    return sigma * sigma;
  }
  double far() const { return (model_.centre - frame_.eye()).norm() + 1.01 * model_.radius; }

  void take(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      times_[i] = frame_.go_to(*batch_[i]);
      rays_[i] = {frame_.eye(), frame_.turn() * batch_[i]->direction};
    }
    model_.caster.cast({rays_.data(), count}, far(), hits_);
    for (std::size_t i = 0; i < count; ++i) {
      const RayHit& hit = hits_[i];
      const Ray& ray = rays_[i];
      if (!std::isfinite(hit.range)) {
        if (batch_[i]->hit()) result_.cost += past_cost_;
        take_beside(*batch_[i], times_[i], ray);
        continue;
      }
      const double cosine = -hit.normal.dot(ray.direction);
      const Vector3d point = ray.origin + hit.range * ray.direction;
      // On the surface the noise reaches farther the more it slopes.
      const double reach = edge_reach_ * hit.range / std::max(cosine, 0.2);
      if (options_.edges && model_.borders.near(hit.triangle, point, reach)) {
        take_near_edge(*batch_[i], ray, hit);
        continue;
      }
      const double sine2 = 1 - cosine * cosine;
      if (!take_plain(*batch_[i], times_[i], hit.normal, point, hit.range, cosine,
                      hit.range * hit.range * sine2 * angle_variance_)) {
        result_.cost += gate2_;
        take_beside(*batch_[i], times_[i], ray);
      }
    }
  }

  /// A return that the model does not explain, but which is near it.
  void take_beside(const Beam& beam, double time, const Ray& ray) {
    if (!beam.hit()) return;
    const Vector3d point = ray.origin + beam.range * ray.direction;
    ClosestPointGrid::Match match;
    if (!model_.grid.refined(point, match)) return;
    const Vector3d away = point - match.point;
    const double distance2 = away.squaredNorm();
    const double reach2 = options_.pull_m * options_.pull_m;
    if (distance2 > reach2 || !(distance2 > 0)) return;
    ++result_.beside;
    if (options_.pull_sigma_m == 0) return;
    const double distance = std::sqrt(distance2);
    const double rest = 1 - distance2 / reach2;
    const double weight = rest * rest / (options_.pull_sigma_m * options_.pull_sigma_m);  // Tukey
    const Vector3d direction = away / distance;
    sums_.add(direction, match.point.cross(direction), weight, weight * distance, time);
  }

  /// One face: a row. @return whether the return fits it, or there is none.
  bool take_plain(const Beam& beam, double time, const Vector3d& normal, const Vector3d& point,
                  double range, double cosine, double angle_variance) {
    if (cosine < options_.least_cosine) {
      if (beam.hit()) result_.cost += gate2_;
      return true;
    }
    ++result_.predicted;
    if (!beam.hit()) {
      ++result_.through;
      result_.cost += 0.5 * gate2_;
      return true;
    }
    const double variance =
        cosine * cosine * range_variance(beam) + angle_variance + model_variance_;
    const double residual = cosine * (range - beam.range);
    const Vector3d torque = point.cross(normal);
    const double squared = residual * residual;
    if (squared > gate2_ * variance &&
        squared > gate2_ * (variance + pose_variance(normal, torque))) {
      ++(residual < 0 ? result_.through : result_.blocked);
      return false;
    }
    ++result_.used;
    const double z2 = squared / variance;
    result_.chi2 += z2;
    result_.cost += std::min(z2, gate2_);
    sums_.add(normal, torque, 1 / variance, residual / variance, time);
    return true;
  }

  /// Variance along the normal that the pose's uncertainty brings about.
  double pose_variance(const Vector3d& normal, const Vector3d& torque) const {
    if (certain_) return 0;
    Vector6d j;
    j << normal, torque;
    return j.dot(covariance_ * j);
  }

  /// A beam near an end of the face that it meets: cast beside itself, too.
  void take_near_edge(const Beam& beam, const Ray& ray, const RayHit& hit) {
    const double time = frame_.go_to(beam);
    const Vector3d& d = beam.direction;
    const double level = std::max(1e-9, std::hypot(d.x(), d.z()));
    // Derivatives of beam_direction(), times the length of an arm.
    const Vector3d right = frame_.turn() * Vector3d(d.z(), 0, -d.x()) * arm_right_;
    const Vector3d up =
        frame_.turn() * Vector3d(d.x() * d.y() / level, -level, d.z() * d.y() / level) * arm_up_;
    node_rays_[0] = ray;
    node_hits_[0] = hit;
    for (std::size_t n = 1; n < BeamNodes::count; ++n) {
      node_rays_[n] = {
          ray.origin,
          (ray.direction + BeamNodes::right[n] * right + BeamNodes::up[n] * up).normalized()};
    }
    model_.caster.cast(std::span(node_rays_).subspan(1), far(), std::span(node_hits_).subspan(1));
    if (meet_one_plane(node_rays_, node_hits_)) {
      const double cosine = -hit.normal.dot(ray.direction);
      take_plain(beam, time, hit.normal, ray.origin + hit.range * ray.direction, hit.range, cosine,
                 hit.range * hit.range * (1 - cosine * cosine) * angle_variance_);
    } else {
      take_edge(beam, time, node_rays_, node_hits_, right, up);
    }
  }

  bool meet_one_plane(std::span<const Ray> rays, std::span<const RayHit> hits) const {
    if (!std::isfinite(hits[0].range)) return false;
    const Vector3d& normal = hits[0].normal;
    const Vector3d place = rays[0].origin + hits[0].range * rays[0].direction;
    for (std::size_t n = 1; n < hits.size(); ++n) {
      if (!std::isfinite(hits[n].range) || normal.dot(hits[n].normal) < 0.99) return false;
      const Vector3d other = rays[n].origin + hits[n].range * rays[n].direction;
      if (std::abs(normal.dot(other - place)) > same_plane * beam_model_.range_sigma_m) {
        return false;
      }
    }
    return true;
  }

  /// A beam at an edge: the score of its likelihood, integrated over the directions that it may
  /// have had. Moving the model along the beam moves the expected ranges; moving it across moves
  /// the edge, which is the same as moving the beam the other way, and so is the integral weighed
  /// with the score of the angle noise. The information is the score's square (Berndt, Hall, Hall
  /// and Hausman 1974): right on average, and never negative.
  void take_edge(const Beam& beam, double time, std::span<const Ray> rays,
                 std::span<const RayHit> hits, const Vector3d& right, const Vector3d& up) {
    const LikelihoodOptions& shares = options_.likelihood;
    std::size_t front = BeamNodes::count;
    double on = 0;
    for (std::size_t n = 0; n < BeamNodes::count; ++n) {
      if (!std::isfinite(hits[n].range)) continue;
      on += BeamNodes::weight[n];
      if (front == BeamNodes::count || hits[n].range < hits[front].range) front = n;
    }
    if (front == BeamNodes::count) {
      if (beam.hit()) result_.cost += past_cost_;
      return;
    }
    // The edge is the front face's: it goes where that goes.
    const double edge_range = hits[front].range;
    const Vector3d edge = rays[front].origin + edge_range * rays[front].direction;
    const double variance = range_variance(beam) + model_variance_;
    const double regular =
        (1 - shares.drop_out - shares.outlier) / std::sqrt(2 * radians(180.0) * variance);
    double sum = 0;
    double regular_sum = 0;
    double chi2 = 0;
    const Vector3d per_right = right / std::max(1e-30, right.squaredNorm());
    const Vector3d per_up = up / std::max(1e-30, up.squaredNorm());
    Vector3d force = Vector3d::Zero();
    Vector3d torque = Vector3d::Zero();
    for (std::size_t n = 0; n < BeamNodes::count; ++n) {
      const bool meets = std::isfinite(hits[n].range);
      const Vector3d& direction = rays[n].direction;
      double density = 0;
      if (!beam.hit()) {
        density = meets ? shares.drop_out : 1 - shares.background;
      } else if (!meets) {
        density = shares.background / shares.background_depth_m;
      } else {
        const double late = beam.range - hits[n].range;
        const double likely = regular * std::exp(-0.5 * late * late / variance);
        density = likely + shares.outlier / shares.background_depth_m;
        regular_sum += BeamNodes::weight[n] * likely;
        chi2 += BeamNodes::weight[n] * likely * late * late / variance;
        const double pull = BeamNodes::weight[n] * likely * late / variance;
        const Vector3d point = rays[n].origin + hits[n].range * direction;
        const Vector3d& normal = hits[n].normal;
        const double facing = normal.dot(direction);
        if (-facing > options_.least_cosine) {
          // Of the face's motion, that which is not the edge's motion across the beam.
          const Vector3d own = pull / facing * normal;
          const Vector3d shared =
              pull * hits[n].range / edge_range / facing * (normal - facing * direction);
          force += own - shared;
          torque += point.cross(own) - edge.cross(shared);
        } else {
          force += pull * direction;
          torque += pull * point.cross(direction);
        }
      }
      density *= BeamNodes::weight[n];
      sum += density;
      const Vector3d across =
          -3 * density / edge_range * (BeamNodes::right[n] * per_right + BeamNodes::up[n] * per_up);
      force += across;
      torque += edge.cross(across);
    }
    const bool regularly = beam.hit() && regular_sum > 0.5 * sum;
    if (regularly || on > 0.5) ++result_.predicted;
    if (regularly) {
      ++result_.used;
      result_.chi2 += chi2 / regular_sum;
      result_.cost += std::min(chi2 / regular_sum, gate2_);
    } else {
      result_.cost += beam.hit() ? on * gate2_ + (1 - on) * past_cost_ : 0.5 * gate2_ * on;
    }
    if (!regularly && on > 0.5) {
      ++(beam.hit() && beam.range < edge_range ? result_.blocked : result_.through);
    }
    sums_.add(force / sum, torque / sum, 1, 1, time);
  }

  static constexpr double same_plane = 0.1;  // range sigmas

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const BeamInformationOptions& options_;
  const BeamLinearisation& at_;
  MovingFrame frame_;
  NormalSums sums_;
  double angle_variance_, arm_right_, arm_up_;
  double model_variance_, gate2_;
  double past_cost_;  // of a return from something behind, as is to be expected past the model
  Matrix6d covariance_;
  bool certain_;
  double edge_reach_;  // rad
  std::array<const Beam*, chunk> batch_;
  std::array<double, chunk> times_;
  std::array<Ray, chunk> rays_;
  std::array<RayHit, chunk> hits_;
  std::array<Ray, BeamNodes::count> node_rays_;
  std::array<RayHit, BeamNodes::count> node_hits_;
  BeamInformation result_;
};

}  // namespace

BeamInformation& BeamInformation::operator+=(const BeamInformation& other) {
  for (std::size_t i = 0; i < 3; ++i) information[i] += other.information[i];
  for (std::size_t i = 0; i < 2; ++i) gradient[i] += other.gradient[i];
  chi2 += other.chi2;
  cost += other.cost;
  used += other.used;
  predicted += other.predicted;
  through += other.through;
  blocked += other.blocked;
  beside += other.beside;
  return *this;
}

MotionInformation BeamInformation::motion() const {
  MotionInformation joint;
  joint.information << information[0], information[1], information[1], information[2];
  joint.gradient << gradient[0], gradient[1];
  joint.returns = used;
  return joint;
}

BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options) {
  return Accumulator(model, beam_model, at, options)
      .run(beams.size(), [beams](std::size_t i) -> const Beam& { return beams[i]; });
}

BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const std::uint32_t> picks) {
  return Accumulator(model, beam_model, at, options)
      .run(picks.size(), [beams, picks](std::size_t i) -> const Beam& { return beams[picks[i]]; });
}

}  // namespace berth::estimator
