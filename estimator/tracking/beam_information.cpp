// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_information.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "estimator/model/normal_sums.h"
#include "estimator/tracking/edge_beam.h"
#include "estimator/tracking/foreground.h"
#include "estimator/tracking/moving_frame.h"
#include "estimator/tracking/sure_beams.h"

namespace berth::estimator {

namespace {

constexpr std::size_t chunk = 64;  // beams at a time, on the stack
constexpr std::size_t ahead = 80;  // beams that are asked of memory before they are looked at

Matrix6d both(const Matrix3d& rotation) {
  Matrix6d m = Matrix6d::Zero();
  m.topLeftCorner<3, 3>() = rotation;
  m.bottomRightCorner<3, 3>() = rotation;
  return m;
}

class Accumulator {
 public:
  Accumulator(const TargetModel& model, const BeamModel& beam_model, std::span<const Beam> beams,
              const BeamLinearisation& at, const BeamInformationOptions& options,
              std::vector<MetFace>* at_edges = nullptr, const Foreground* foreground = nullptr)
      : model_(model),
        beam_model_(beam_model),
        beams_(beams),
        options_(options),
        at_edges_(at_edges),
        foreground_(foreground),
        at_(at),
        frame_(at),
        sums_(options.of_velocity),
        edge_sums_(options.of_velocity) {
    const double az = beam_model.azimuth_sigma_rad;
    const double el = beam_model.elevation_sigma_rad;
    angle_variance_ = beam_model.angle_variance();
    least_reach_ = options.edge_sigmas * std::sqrt(angle_variance_);
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
    // A disc of even light; as wide at the target as there.
    const double range = centre.norm();
    const double footprint = options.likelihood.footprint ? beam_model.footprint(range) : 0;
    const double half_angle = 0.5 * footprint / range;
    const double width2 = 0.25 * half_angle * half_angle;
    wide_ = width2 > 0;
    edge_variance_ = std::pow(least_edge_share * footprint, 2);
    // While only faces tell, where else a beam may have gone is left to the gate.
    const double chance = options.edges || at_edges != nullptr ? 1 : 0;
    const double right2 = chance * (az * az + extra2) + width2;
    const double up2 = chance * (el * el + extra2) + width2;
    arm_right_ = std::sqrt(3.0 * right2);
    arm_up_ = std::sqrt(3.0 * up2);
    edge_reach_ = options.edge_sigmas * std::sqrt(0.5 * (right2 + up2));
    blurred_ = angles_blur_edges(beam_model, range);
    edge_.footprint = wide_ ? 2 * width2 / (right2 + up2) : 0;
    edge_.pulse_m = wide_ ? beam_model.pulse_length_m : 0;
    edge_.least_light = beam_model.min_echo / (1 + beam_model.min_echo);  // of an even beam
  }

  BeamInformation cast(std::span<const std::uint32_t> picks) {
    if (SureBeams::pays(model_, picks.size())) find_sure(picks);
    return cast(picks.size(), [picks](std::size_t i) { return picks[i]; });
  }

  /// The beams with these indices.
  template <class IndexAt>
  BeamInformation cast(std::size_t total, const IndexAt& index) {
    for (std::size_t i = 0; i < total;) {
      std::size_t count = 0;
      for (; count < chunk && i < total; ++i) {
        const std::uint32_t next = index(i);
        fetch(index(std::min(i + ahead, total - 1)));
        if (options_.misses || beams_[next].hit()) batch_[count++] = next;
      }
      if (sure_) count = take_sure(count);
      aim(count);
      model_.caster.cast({rays_.data(), count}, far(), hits_);
      take(count);
    }
    return sum_up();
  }

  /// Without a cast where it is known what each met before: at the plane of that.
  BeamInformation meet_again(std::span<const MetFace> met) {
    for (std::size_t first = 0; first < met.size(); first += chunk) {
      const auto some = met.subspan(first, std::min(chunk, met.size() - first));
      for (std::size_t n = 0; n < some.size(); ++n) {
        batch_[n] = some[n].beam;
        fetch(met[std::min(first + n + ahead, met.size() - 1)].beam);
      }
      aim(some.size());
      meet(some);
      take(some.size());
    }
    return sum_up();
  }

 private:
  void fetch(std::uint32_t beam) const { __builtin_prefetch(&beams_[beam]); }

  BeamInformation sum_up() {
    sums_.flush();
    edge_sums_.flush();
    const double weight = 1 / (1 + edge_information_ * edge_variance_);  // of edges
    if (sure_) {
      sums_ += sure_->sums();
      result_.predicted += sure_->used();
      result_.used += sure_->used();
      result_.chi2 += sure_->chi2();
      result_.cost += sure_->chi2();
    }
    const Matrix6d back = both(at_.pose.rotation.toRotationMatrix());
    for (std::size_t k = 0; k < 3; ++k) {
      const Matrix6d a =
          back * (sums_.products(k) + weight * edge_sums_.products(k)) * back.transpose();
      result_.information[k] = 0.5 * (a + a.transpose());
      if (k < 2) {
        result_.gradient[k] = back * (sums_.residuals(k) + weight * edge_sums_.residuals(k));
      }
    }
    return result_;
  }

  double range_variance(const Beam& beam) const {
    const double sigma = beam.range_sigma > 0 ? beam.range_sigma : beam_model_.range_sigma_m;
    return sigma * sigma;
  }
  double far() const { return (model_.centre - frame_.eye()).norm() + 1.01 * model_.radius; }

  void aim(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const Beam& beam = beams_[batch_[i]];
      times_[i] = frame_.go_to(beam);
      rays_[i] = {frame_.eye(), frame_.turn() * beam.direction};
    }
  }

  void find_sure(std::span<const std::uint32_t> picks) {
    const double arms = blurred_ ? farther * std::hypot(arm_right_, arm_up_) : 0;
    sure_.emplace(model_, beam_model_, beams_, at_, options_, picks, std::max(edge_reach_, arms),
                  foreground_ != nullptr ? foreground_->eye() : frame_.eye());
  }

  /// Those of the batch. @return how many are left: they are its first now.
  std::size_t take_sure(std::size_t count) {
    constexpr std::size_t lanes = SureBeams::lanes;
    std::size_t left = 0;
    for (std::size_t first = 0; first < count; first += lanes) {
      const std::span<const std::uint32_t> some(&batch_[first], std::min(lanes, count - first));
      const unsigned taken = some.size() == lanes ? sure_->take(some.first<lanes>()) : 0;
      for (std::size_t n = 0; n < some.size(); ++n) {
        if ((taken >> n & 1U) == 0) batch_[left++] = some[n];
      }
    }
    return left;
  }

  void meet(std::span<const MetFace> met) {
    std::array<Ray, chunk> cast_rays;
    std::array<RayHit, chunk> cast_hits;
    std::array<std::size_t, chunk> cast;
    std::size_t count = 0;
    for (std::size_t n = 0; n < met.size(); ++n) {
      if (!meets_as_before(met[n].triangle, rays_[n], hits_[n])) {
        cast_rays[count] = rays_[n];
        cast[count++] = n;
      }
    }
    model_.caster.cast({cast_rays.data(), count}, far(), cast_hits);
    for (std::size_t k = 0; k < count; ++k) hits_[cast[k]] = cast_hits[k];
  }

  /// @return false where it has to be cast.
  bool meets_as_before(std::uint32_t triangle, const Ray& ray, RayHit& hit) const {
    if (triangle == MetFace::unknown) return false;
    const bool to_be_sure = at_edges_ == nullptr && foreground_ != nullptr;
    hit.range = std::numeric_limits<double>::infinity();
    if (triangle == MetFace::none) return !to_be_sure;
    model_.caster.meet(ray, triangle, hit);
    if (!to_be_sure) return true;
    const Vector3d point = ray.origin + hit.range * ray.direction;
    return !model_.borders.near(triangle, point, 0) &&
           !foreground_->near(triangle, point, least_reach_ * hit.range);
  }

  void take(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) take(batch_[i], times_[i], rays_[i], hits_[i]);
  }

  void take(std::uint32_t index, double time, const Ray& ray, const RayHit& hit) {
    const Beam& beam = beams_[index];
    if (at_edges_ != nullptr && may_change_face(beam, ray, hit)) {
      at_edges_->push_back({index, std::isfinite(hit.range) ? hit.triangle : MetFace::none});
      if (options_.doubtful && fits(beam, ray, hit)) ++result_.doubtful;
      return;
    }
    if (!std::isfinite(hit.range)) {
      if (may_touch(beam, ray) && take_near_edge(beam, ray, hit)) return;
      if (beam.hit()) result_.cost += past_cost_;
      take_beside(beam, time, ray);
      return;
    }
    const double cosine = -hit.normal.dot(ray.direction);
    const Vector3d point = ray.origin + hit.range * ray.direction;
    // On the surface the noise reaches farther the more it slopes.
    const double reach = edge_reach_ * hit.range / std::max(cosine, 0.2);
    if ((options_.edges || wide_) && model_.borders.near(hit.triangle, point, reach) &&
        take_near_edge(beam, ray, hit)) {
      return;
    }
    if (take_plain(beam, time, hit, point, cosine)) return;
    const bool nearer = beam.range < hit.range;
    if (wide_ && nearer && take_near_edge(beam, ray, hit)) return;
    ++result_.predicted;
    ++(nearer ? result_.blocked : result_.through);
    result_.cost += gate2_;
    take_beside(beam, time, ray);
  }

  /// Whether the pose or the angle noise may have it meet another face, or none.
  bool may_change_face(const Beam& beam, const Ray& ray, const RayHit& hit) {
    if (!std::isfinite(hit.range)) {
      if (!beam.hit()) return false;
      const double reach = edge_reach_ * (ray.origin - model_.centre).norm();
      // Most return from the edge that they pass.
      return model_.distances.may_be_near(ray.origin + beam.range * ray.direction, reach) ||
             model_.distances.may_come_near(ray, reach);
    }
    const double cosine = -hit.normal.dot(ray.direction);
    const double reach = edge_reach_ * hit.range / std::max(cosine, 0.2);
    const Vector3d point = ray.origin + hit.range * ray.direction;
    if (model_.borders.near(hit.triangle, point, reach)) return true;
    if (foreground_ != nullptr && foreground_->near(hit.triangle, point, edge_reach_ * hit.range))
      return true;
    // Something may stand before the face. Where beams go far astray that counts, from about as far
    // off as an end of this face does.
    return blurred_ && (cast_beside(beam, ray, hit) || cast_beside(beam, ray, hit, farther));
  }

  /// Whether a beam that passes the model may be so wide that its light does not.
  bool may_touch(const Beam& beam, const Ray& ray) const {
    if (!wide_) return false;
    if (options_.edges) return true;
    if (!beam.hit()) return false;
    ClosestPointGrid::Match match;
    const Vector3d point = ray.origin + beam.range * ray.direction;
    if (!model_.grid.refined(point, match)) return false;
    const double reach = edge_reach_ * beam.range;
    const double noise2 = gate2_ * range_variance(beam) + reach * reach;
    return (point - match.point).squaredNorm() < noise2;
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
  bool take_plain(const Beam& beam, double time, const RayHit& hit, const Vector3d& point,
                  double cosine) {
    if (cosine < options_.least_cosine) {
      if (beam.hit()) result_.cost += gate2_;
      return true;
    }
    if (!beam.hit()) {
      ++result_.predicted;
      ++result_.through;
      result_.cost += 0.5 * gate2_;
      return true;
    }
    const double variance = plain_variance(beam, hit, cosine);
    const double residual = cosine * (hit.range - beam.range);
    const Vector3d torque = point.cross(hit.normal);
    if (!in_gate(residual, variance, hit.normal, torque)) return false;
    ++result_.predicted;
    ++result_.used;
    const double z2 = residual * residual / variance;
    result_.chi2 += z2;
    result_.cost += std::min(z2, gate2_);
    sums_.add(hit.normal, torque, 1 / variance, residual / variance, time);
    return true;
  }

  /// Of a return from one face, along its normal, m^2.
  double plain_variance(const Beam& beam, const RayHit& hit, double cosine) const {
    const double sine2 = 1 - cosine * cosine;
    return cosine * cosine * range_variance(beam) +
           hit.range * hit.range * sine2 * angle_variance_ + model_variance_;
  }

  /// Whether a return is of the face that its beam meets.
  bool fits(const Beam& beam, const Ray& ray, const RayHit& hit) const {
    const double cosine = -hit.normal.dot(ray.direction);
    if (!beam.hit() || !std::isfinite(hit.range) || cosine < options_.least_cosine) return false;
    const Vector3d point = ray.origin + hit.range * ray.direction;
    return in_gate(cosine * (hit.range - beam.range), plain_variance(beam, hit, cosine), hit.normal,
                   point.cross(hit.normal));
  }

  bool in_gate(double residual, double variance, const Vector3d& normal,
               const Vector3d& torque) const {
    const double squared = residual * residual;
    return squared <= gate2_ * variance ||
           squared <= gate2_ * (variance + pose_variance(normal, torque));
  }

  /// Variance along the normal that the pose's uncertainty brings about.
  double pose_variance(const Vector3d& normal, const Vector3d& torque) const {
    if (certain_) return 0;
    Vector6d j;
    j << normal, torque;
    return j.dot(covariance_ * j);
  }

  /// A beam near an end of the face that it meets: cast beside itself, too. @return false when it
  /// is none: what it meets is one face, or nothing.
  bool take_near_edge(const Beam& beam, const Ray& ray, const RayHit& hit) {
    if (!cast_beside(beam, ray, hit)) return false;
    const double time = frame_.go_to(beam);
    if (options_.edges) {
      take_edge(beam, time);
      return true;
    }
    return take_mixed(beam, time);
  }

  /// @return whether what is beside it, so many arms away, is another face, or none.
  bool cast_beside(const Beam& beam, const Ray& ray, const RayHit& hit, double arms = 1) {
    frame_.go_to(beam);
    const Vector3d& d = beam.direction;
    const double level = std::max(1e-9, std::sqrt(d.x() * d.x() + d.z() * d.z()));
    // Derivatives of beam_direction(), times the length of an arm.
    edge_.right = frame_.turn() * Vector3d(d.z(), 0, -d.x()) * (arms * arm_right_);
    edge_.up = frame_.turn() * Vector3d(d.x() * d.y() / level, -level, d.z() * d.y() / level) *
               (arms * arm_up_);
    edge_.rays[0] = ray;
    edge_.hits[0] = hit;
    for (std::size_t n = 1; n < BeamNodes::count; ++n) {
      edge_.rays[n] = {ray.origin, (ray.direction + BeamNodes::right[n] * edge_.right +
                                    BeamNodes::up[n] * edge_.up)
                                       .normalized()};
    }
    model_.caster.cast(std::span(edge_.rays).subspan(1), far(), std::span(edge_.hits).subspan(1));
    return edge_.meets() && !edge_.one_plane(same_plane * beam_model_.range_sigma_m);
  }

  /// A beam whose light meets several faces, or one and what is behind it: the range is their mean,
  /// if it can be.
  bool take_mixed(const Beam& beam, double time) {
    const auto echo = mixed_echo(edge_, options_.least_cosine);
    if (!echo) return false;
    if (!beam.hit()) {
      // Light from half of it would have been seen.
      if (echo->share > 0.5) {
        ++result_.predicted;
        ++result_.through;
      }
      result_.cost += 0.5 * gate2_ * echo->share;
      return true;
    }
    const double variance = range_variance(beam) + model_variance_ + doubtful_shares * echo->spread;
    const double residual = echo->range - beam.range;
    // Else what is behind came back alone.
    if (!in_gate(residual, variance, echo->normal, echo->torque)) return false;
    ++result_.predicted;
    ++result_.used;
    const double z2 = residual * residual / variance;
    result_.chi2 += z2;
    result_.cost += std::min(z2, gate2_);
    sums_.add(echo->normal, echo->torque, 1 / variance, residual / variance, time);
    return true;
  }

  /// A beam at an edge. The information is the score's square (Berndt, Hall, Hall and Hausman
  /// 1974): right on average, and never negative.
  void take_edge(const Beam& beam, double time) {
    const double variance = range_variance(beam) + model_variance_;
    const EdgeScore score =
        edge_score(edge_, beam, variance, options_.likelihood, options_.least_cosine);
    const double on = score.on;
    const bool regularly = beam.hit() && score.regular > 0.5;
    if (regularly || on > 0.5) ++result_.predicted;
    if (regularly) {
      ++result_.used;
      result_.chi2 += score.chi2;
      result_.cost += std::min(score.chi2, gate2_);
    } else {
      result_.cost += beam.hit() ? on * gate2_ + (1 - on) * past_cost_ : 0.5 * gate2_ * on;
    }
    if (!regularly && on > 0.5) {
      ++(beam.hit() && beam.range < score.front ? result_.blocked : result_.through);
    }
    edge_sums_.add(score.force, score.torque, 1, 1, time);
    edge_information_ += score.outwards * score.outwards;
  }

  static constexpr double farther = 1.5;  // arms
  /// How much light which of several surfaces returns is not known: on the variance of their mean.
  static constexpr double doubtful_shares = 4;
  /// Of the footprint, standard deviation: where edges are is told no better by all of a scan's
  /// beams together. How much of a face's light makes an echo depends on what lies behind.
  static constexpr double least_edge_share = 0.08;
  static constexpr double same_plane = 0.1;  // range sigmas

  const TargetModel& model_;
  const BeamModel& beam_model_;
  std::span<const Beam> beams_;
  const BeamInformationOptions& options_;
  std::vector<MetFace>* at_edges_;
  const Foreground* foreground_;
  const BeamLinearisation& at_;
  MovingFrame frame_;
  NormalSums sums_;
  std::optional<SureBeams> sure_;  // where there are many beams
  NormalSums edge_sums_;
  double angle_variance_, least_reach_, arm_right_, arm_up_;
  double model_variance_, gate2_;
  double past_cost_;  // of a return from something behind, as is to be expected past the model
  Matrix6d covariance_;
  bool certain_;
  double edge_reach_;                       // rad
  std::array<std::uint32_t, chunk> batch_;  // indices of the beams
  std::array<double, chunk> times_;
  std::array<Ray, chunk> rays_;
  std::array<RayHit, chunk> hits_;
  bool wide_;
  bool blurred_;
  double edge_variance_;         // m^2, see least_edge_share
  double edge_information_ = 0;  // 1/m^2, of where edges are
  EdgeBeam edge_;
  BeamInformation result_;
};

}  // namespace

bool angles_blur_edges(const BeamModel& beam_model, double range) {
  const double angle = std::hypot(beam_model.azimuth_sigma_rad, beam_model.elevation_sigma_rad);
  return angle / std::sqrt(2.0) * range > 0.2 * beam_model.range_sigma_m;
}

BeamInformation& BeamInformation::operator+=(const BeamInformation& other) {
  for (std::size_t i = 0; i < 3; ++i) information[i] += other.information[i];
  for (std::size_t i = 0; i < 2; ++i) gradient[i] += other.gradient[i];
  chi2 += other.chi2;
  cost += other.cost;
  used += other.used;
  doubtful += other.doubtful;
  predicted += other.predicted;
  through += other.through;
  blocked += other.blocked;
  beside += other.beside;
  return *this;
}

double BeamInformation::contradicted() const {
  const int against = through + beside;
  return static_cast<double>(against) / std::max(1, used + against);
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
  return Accumulator(model, beam_model, beams, at, options).cast(beams.size(), [](std::size_t i) {
    return static_cast<std::uint32_t>(i);
  });
}

BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const std::uint32_t> picks) {
  return Accumulator(model, beam_model, beams, at, options).cast(picks);
}

BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const std::uint32_t> picks,
                                 std::vector<MetFace>& at_edges, const Foreground* foreground) {
  at_edges.clear();
  return Accumulator(model, beam_model, beams, at, options, &at_edges, foreground).cast(picks);
}

BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const MetFace> met) {
  return Accumulator(model, beam_model, beams, at, options).meet_again(met);
}

BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const MetFace> met, const Foreground& foreground) {
  return Accumulator(model, beam_model, beams, at, options, nullptr, &foreground).meet_again(met);
}

BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const MetFace> met, std::vector<MetFace>& at_edges,
                                 const Foreground* foreground) {
  at_edges.clear();
  return Accumulator(model, beam_model, beams, at, options, &at_edges, foreground).meet_again(met);
}

}  // namespace berth::estimator
