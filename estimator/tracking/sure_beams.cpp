// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/sure_beams.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

namespace {

/// Of an image: finer ones take longer to draw than they save.
int cells_for(std::size_t beams) {
  constexpr double beams_of_cell = 2;  // of the square about the target
  constexpr double most = 400;
  return static_cast<int>(std::min(most, std::sqrt(static_cast<double>(beams) / beams_of_cell)));
}

}  // namespace

bool SureBeams::pays(const TargetModel& model, std::size_t beams) {
  constexpr std::size_t least = 10000;
  constexpr std::size_t of_a_triangle = 20;
  return beams >= least && beams >= of_a_triangle * model.target.mesh.triangles.size();
}

SureBeams::SureBeams(const TargetModel& model, const BeamModel& beam_model,
                     std::span<const Beam> beams, const BeamLinearisation& at,
                     const BeamInformationOptions& options, std::span<const std::uint32_t> picks,
                     double reach, const Vector3d& about)
    : model_(model),
      beams_(beams),
      options_(options),
      frame_(at),
      image_(model, view(picks, reach, about), cells_for(picks.size())),
      range_sigma_(beam_model.range_sigma_m),
      angle_variance_(beam_model.angle_variance()),
      model_variance_(options.model_sigma_m * options.model_sigma_m),
      gate2_(options.gate_sigmas * options.gate_sigmas),
      eye_(four(frame_.eye())),
      sums_(options.of_velocity) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    turn_[static_cast<std::size_t>(i)] = four(Vector3d(frame_.turn().row(i)));
  }
}

/// From between where the first and the last beam come from.
FaceImage::View SureBeams::view(std::span<const std::uint32_t> picks, double reach,
                                const Vector3d& about) {
  frame_.go_to(beams_[picks.front()]);
  const Vector3d first = frame_.eye();
  frame_.go_to(beams_[picks.back()]);
  const Vector3d last = frame_.eye();
  const Vector3d eye = 0.5 * (first + last);
  constexpr double curved = 1.02;  // the way between them
  return {eye, std::max(curved * 0.5 * (last - first).norm(), (about - eye).norm()), reach};
}

SureBeams::Seen SureBeams::see(std::span<const std::uint32_t, lanes> picks) {
  const auto each = [&](const auto& of) {
    return Four{of(beams_[picks[0]]), of(beams_[picks[1]]), of(beams_[picks[2]]),
                of(beams_[picks[3]])};
  };
  Seen seen;
  seen.range = each([](const Beam& beam) { return beam.range; });
  const Four sigma = each([](const Beam& beam) { return beam.range_sigma; });
  const Four known = sigma > 0 ? sigma : four(range_sigma_);
  seen.variance = known * known;
  seen.time = four(0);
  if (!frame_.moves()) {
    const Four3 d{each([](const Beam& beam) { return beam.direction.x(); }),
                  each([](const Beam& beam) { return beam.direction.y(); }),
                  each([](const Beam& beam) { return beam.direction.z(); })};
    seen.eye = eye_;
    seen.direction = {turn_[0].dot(d), turn_[1].dot(d), turn_[2].dot(d)};
    if (options_.of_velocity) seen.time = each([this](const Beam& b) { return frame_.go_to(b); });
    return seen;
  }
  for (std::size_t n = 0; n < lanes; ++n) {
    const Beam& beam = beams_[picks[n]];
    seen.time[n] = frame_.go_to(beam);
    const Vector3d direction = frame_.turn() * beam.direction;
    seen.eye.set(n, frame_.eye());
    seen.direction.set(n, direction);
  }
  return seen;
}

unsigned SureBeams::take(std::span<const std::uint32_t, lanes> picks) {
  const Seen seen = see(picks);
  const auto triangles = image_.foremost(seen.eye + seen.range * seen.direction);
  unsigned taken = 0;
  unsigned asked = 0;
  for (std::size_t n = 0; n < lanes; ++n) {
    if (triangles[n] == FaceImage::unknown || (asked >> n & 1U) != 0) continue;
    const auto same = [&](std::size_t lane) { return triangles[lane] == triangles[n] ? -1 : 0; };
    const FourFlags which{same(0), same(1), same(2), same(3)};
    asked |= bits(which);
    taken |= bits(take(seen, which, static_cast<std::uint32_t>(triangles[n])));
  }
  return taken;
}

/// Those that may meet a triangle. @return those that do, and are sure.
inline FourFlags SureBeams::take(const Seen& seen, FourFlags which, std::uint32_t triangle) {
  const RayCaster::Plane& plane = model_.caster.plane(triangle);
  const Four3 normal = four(plane.normal);
  // The plane's normal may be of either sign.
  const Four along = normal.dot(seen.direction);
  const Four met = (plane.normal.dot(plane.corner) - normal.dot(seen.eye)) / along;
  const Four3 point = seen.eye + met * seen.direction;
  const Four cosine = along < 0 ? -along : along;
  const FaceImage::View& view = image_.view();
  which &= (cosine >= options_.least_cosine) &
           model_.borders.within(triangle, point, view.reach * met / cosine);
  if (view.sway > 0) {
    const Four off = met - seen.range;
    const Four3 beside = seen.eye - four(view.eye);
    which &= (off < FaceImage::slack_m) & (off > -FaceImage::slack_m) &
             (beside.dot(beside) <= view.sway * view.sway);
  }
  const Four variance = along * along * seen.variance +
                        met * met * (1 - along * along) * angle_variance_ + model_variance_;
  const Four residual = along * (seen.range - met);  // along the normal
  const Four squared = residual * residual;
  which &= squared <= gate2_ * variance;
  const int taken = count(which);
  if (taken == 0) return which;
  used_ += taken;
  const Four weight = which ? 1 / variance : four(0);
  chi2_ += which ? weight * squared : four(0);
  sums_.add(normal, point.cross(normal), weight, which ? weight * residual : four(0), seen.time);
  return which;
}

}  // namespace berth::estimator
