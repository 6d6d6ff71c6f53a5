// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/core/beam_model.h"
#include "estimator/filter/motion_information.h"
#include "estimator/likelihood/beam_likelihood.h"
#include "estimator/model/target_model.h"
#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

class Foreground;

/// Where a batch of beams is linearised: the target's motion as it is believed to be. Sensor frame.
struct BeamLinearisation : Motion {  ///< at utime; each beam is used at its own time
  std::int64_t utime = 0;            ///< reference; any time, before, in or after the batch
  /// Covariance of pose, as berth::perturbed: widens the gate. Zero where the pose is the last
  /// word.
  Matrix6d covariance = Matrix6d::Zero();
};

struct BeamInformationOptions {
  double gate_sigmas = 4;     ///< a return farther from the face that its beam meets is not used
  double model_sigma_m = 0;   ///< of the real surface about the mesh, along its normal
  double least_cosine = 0.1;  ///< of the incidence; below it a range says little of the surface
  /// Beams that meet the model nearer to the end of a face than their angle noise are integrated
  /// over the faces that they may have met; there misses tell of the pose, too.
  bool edges = true;
  double edge_sigmas = 2.5;  ///< so near to an end of a face the pose, or the beam's own angle
                             ///< noise, may have it meet another
  /// While the pose is still rough: a return that does not fit the face its beam meets, or whose
  /// beam passes the model, but which is within pull_m of it, is drawn to the nearest surface with
  /// this standard deviation. It brings back panels that have slipped along themselves. 0: no pull.
  double pull_sigma_m = 0;
  double pull_m = 0.15;     ///< nearer than this to the model a return counts as beside it
  bool misses = true;       ///< else beams that returned nothing are left out: not even counted
  bool doubtful = true;     ///< else returns left to others are not counted
  bool of_velocity = true;  ///< else of the pose alone: information[0] and gradient[0]
  LikelihoodOptions likelihood;  ///< for beams at an edge: shares of misses and outliers
};

/// What a batch of beams (one or a million) says of the pose, and of the velocity, at the reference
/// time: the sums of a Gauss-Newton step on the beams' log-likelihood. With r the residual of a
/// return along the normal n of the face that its beam meets, s its standard deviation (range noise
/// times the cosine of the incidence, angle noise its sine), t its time after the reference and
/// J = [n; arm x n] the change of r with the pose:
///
///     information[k] = sum t^k J J^T / s^2,   gradient[k] = sum t^k J r / s^2.
///
/// A beam at an edge adds the score of its likelihood (J r / s^2 otherwise) and the score's square.
/// The pose alone: perturbed(pose, information[0]^-1 gradient[0]). With a prior of covariance P and
/// mean m of the error state x = [pose; velocity]: (P^-1 + H) dx = g + P^-1 (m - x), H and g from
/// motion(); relinearise until dx is small. Batches of one reference add. The turn made since the
/// reference is exact in r and of first order in J.
struct BeamInformation {
  std::array<Matrix6d, 3> information{Matrix6d::Zero(), Matrix6d::Zero(), Matrix6d::Zero()};
  std::array<Vector6d, 2> gradient{Vector6d::Zero(), Vector6d::Zero()};
  double chi2 = 0;  ///< sum of r^2/s^2 of the returns used
  /// Minus twice the log-likelihood, but for a constant: of every return r^2/s^2, at most the
  /// gate's square; of a beam past the model that returned, less by how much more likely that is;
  /// of every miss of a beam that should meet the model, half the gate's square. To compare poses.
  double cost = 0;
  int used = 0;       ///< returns that meet the model where they should
  int doubtful = 0;   ///< beside these: that fit, but their place among the faces is not certain
  int predicted = 0;  ///< beams, misses too, that should meet the model
  int through = 0;    ///< of these, those that saw nothing, or something behind: free space
  int blocked = 0;    ///< of these, those that met something in front: occluders
  int beside = 0;     ///< returns about the model from where it should not be

  /// Share of the beams that contradict the pose: they go through the target, or return from beside
  /// it, of these and those used. Beams stopped before the target do not count.
  double contradicted() const;
  BeamInformation& operator+=(const BeamInformation& other);
  /// Of pose and velocity together, for a filter.
  MotionInformation motion() const;
};

/// Whether angle noise moves a beam on a target there (m) by a good part of its range noise: then a
/// descent's last word is with edges. Else they are too sharp to converge from far.
bool angles_blur_edges(const BeamModel& beam_model, double range);

/// A beam, by its index, and the triangle that it met.
struct MetFace {
  static constexpr std::uint32_t none = 0xffffffffU;     ///< it passed the target by
  static constexpr std::uint32_t unknown = 0xfffffffeU;  ///< is to be found out
  std::uint32_t beam = 0;
  std::uint32_t triangle = none;
};

/// Casts the beams at the model as it moves and sums up their information. Beams that returned
/// nothing only count. Allocates only where so many beams are picked that an image of the target
/// spares most casts (SureBeams); the same bits every time; const, safe from several threads.
BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options);
/// picks: only the beams with these indices.
BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const std::uint32_t> picks);
/// at_edges: beams whose place among the faces is not certain are left to it, in their order: they
/// are in no sum, and count as doubtful where they fit. Beams that neither returned nor meet
/// anything are not asked. foreground: of about that pose; without it what stands before a face
/// counts only where angle noise blurs edges.
BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const std::uint32_t> picks,
                                 std::vector<MetFace>& at_edges,
                                 const Foreground* foreground = nullptr);
/// met: only those of unknown triangle are cast, the others take a third of the time. They are
/// beams where the target has moved since by less than what makes them doubtful: each meets the
/// plane of the same triangle, and is of that face, unless it comes near an end of it.
BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const MetFace> met);
/// foreground: of about that pose; those that may have come past an end since are cast, too.
BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const MetFace> met, const Foreground& foreground);
BeamInformation beam_information(const TargetModel& model, const BeamModel& beam_model,
                                 std::span<const Beam> beams, const BeamLinearisation& at,
                                 const BeamInformationOptions& options,
                                 std::span<const MetFace> met, std::vector<MetFace>& at_edges,
                                 const Foreground* foreground = nullptr);

}  // namespace berth::estimator
