// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/core/beam_model.h"
#include "estimator/model/normal_sums.h"
#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/face_image.h"
#include "estimator/tracking/moving_frame.h"

namespace berth::estimator {

/// Returns that meet one face wherever the target may be, and fit it, as an image of the target
/// tells without a cast: most of a dense scan. What they say is that of BeamInformation; they are
/// looked at four at a time.
class SureBeams {
 public:
  static constexpr std::size_t lanes = 4;

  /// reach: rad; so near to a beam it may meet what is there. about: model frame, m; a place from
  /// which others see what stands before a face. What is passed in must outlive it.
  SureBeams(const TargetModel& model, const BeamModel& beam_model, std::span<const Beam> beams,
            const BeamLinearisation& at, const BeamInformationOptions& options,
            std::span<const std::uint32_t> picks, double reach, const Vector3d& about);

  /// Whether it takes less time than casts of so many beams.
  static bool pays(const TargetModel& model, std::size_t beams);

  /// Sums up those of four beams that are sure. @return a bit for each of these.
  unsigned take(std::span<const std::uint32_t, lanes> picks);

  /// Of those taken, model frame. To be asked when there are no more.
  const NormalSums& sums() {
    sums_.flush();
    return sums_;
  }
  double chi2() const { return sum(chi2_); }
  int used() const { return used_; }

 private:
  struct Seen {  // model frame
    Four3 eye, direction;
    Four range, variance, time;
  };
  FaceImage::View view(std::span<const std::uint32_t> picks, double reach, const Vector3d& about);
  Seen see(std::span<const std::uint32_t, lanes> picks);
  /// In place: what it is given need not go through memory.
  [[gnu::always_inline]] FourFlags take(const Seen& seen, FourFlags which, std::uint32_t triangle);

  const TargetModel& model_;
  std::span<const Beam> beams_;
  const BeamInformationOptions& options_;
  MovingFrame frame_;
  FaceImage image_;
  double range_sigma_, angle_variance_, model_variance_, gate2_;
  std::array<Four3, 3> turn_;  // rows
  Four3 eye_;
  NormalSums sums_;
  Four chi2_ = four(0);
  int used_ = 0;
};

}  // namespace berth::estimator
