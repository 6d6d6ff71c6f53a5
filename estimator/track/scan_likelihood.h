// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "common/core/beam_model.h"
#include "estimator/beam/beam_mixture.h"
#include "estimator/beam/scan.h"
#include "estimator/beam/target_scene.h"
#include "estimator/filter/target_tracker.h"
#include "estimator/optimise/random_effects.h"

namespace berth::estimator {

/// State of one scan. Vectors of it are [pose (6); velocity (6, where unknown); edge offset; range
/// bias (1, where the scanner has one); joint angles], pose and velocity as
/// berth::perturbed(Motion).
struct ScanState {
  Motion motion;          ///< T_sensor_model and its velocity at the scan's mean time, sensor frame
  double rim_offset = 0;  ///< m, outward, of all occluding edges
  double range_bias = 0;  ///< m, added to every range
  std::vector<double> angles;  ///< rad, of TargetScene::joints()
};

/// Which parts of a ScanState are unknown.
struct ScanStateLayout {
  bool velocity = false;
  bool range_bias = false;
  int joints = 0;

  int rim_at() const { return velocity ? 12 : 6; }
  int bias_at() const { return rim_at() + 1; }
  int joints_at() const { return bias_at() + (range_bias ? 1 : 0); }
  int size() const { return joints_at() + joints; }
  ScanState moved(const ScanState& state, const Eigen::VectorXd& by) const;
};

/// Widths added to the likelihood to enlarge its basin of convergence.
struct Annealing {
  double range = 0;  ///< m, 1 sigma, of ranges
  double rim = 0;    ///< m, of occluding edges
};

/// Log-likelihood of the beams of one scan as a function of a ScanState and of the offsets of the
/// surface's patches, linearised at a state. prepare() associates beams with faces, occluding edges
/// and patches at a state; between two calls the function is smooth except where a beam changes its
/// face.
class ScanLikelihood {
 public:
  struct Options {
    int thinning = 1;                    ///< every n-th of the used beams
    double cells = 3;                    ///< patches along a correlation length
    double part_cell = 0.4;              ///< m, size of pieces that are as modelled or elsewhere
    double elsewhere = 0.02;             ///< prior probability that a piece is elsewhere
    Vector3d centre = Vector3d::Zero();  ///< m, of the sphere that holds the target, model frame
    double extent = 3;                   ///< m, its diameter: over which outliers are uniform
    double radius = 3;                   ///< m, of the sphere that holds it at any joint angle
    double depth = edge_depth;           ///< m: minimum depth step at an occluding edge
  };
  /// Statistics of the true surface's distance from the mesh: standard deviation and correlation
  /// length.
  struct Surface {
    double sigma = 0;               ///< m
    double correlation_length = 1;  ///< m
    double reflectivity = 0.5;      ///< diffuse, 0..1
  };

  /// Scene and beam model must outlive it. layout: the unknown parts of a state.
  ScanLikelihood(const TargetScene& scene, const BeamModel& beam_model,
                 const PreprocessedScan& scan, const ScanStateLayout& layout,
                 const Options& options);

  struct Stage {
    Annealing annealing;
    bool patches = false;  ///< the surface is uncertain
    bool pieces = false;   ///< pieces of it may be elsewhere
    int thinning = 1;      ///< every n-th of the used beams
  };
  /// Associates beams at a state. @param surface_of_face one for each face of the scene
  void prepare(const ScanState& state, const Stage& stage,
               const std::vector<Surface>& surface_of_face);

  /// The likelihood linearised about a state.
  struct Linearised {
    double log_likelihood = 0;
    double log_likelihood_without = 0;  ///< of the same beams without a target
    NormalEquations sums;               ///< e is at zero offsets
    // Expected numbers of beams.
    double returns = 0;    ///< of associated beams
    double explained = 0;  ///< of those, from a face as modelled
    /// Number of returns expected from the target, each weighted by its probability of meeting it:
    /// beams that graze an edge hardly validate the pose.
    double expected = 0;
    double fit = 0;           ///< of `expected`, those from a face as modelled
    double square_sum = 0;    ///< m^2: sum of e^2 over `explained`, offsets subtracted
    double variance_sum = 0;  ///< m^2: its expectation, without annealing
    /// Parameters of the next linearise().
    BeamShares shares;  ///< the next of expectation maximisation
  };
  /// @param offsets one for each of patches(), m
  Linearised linearise(const ScanState& state, const Eigen::VectorXd& offsets) const;

  const std::vector<SurfacePatch>& patches() const { return patches_; }
  BeamShares shares;            ///< of the next linearise()
  double noise_scale = 1;       ///< on the range sigma
  FieldScales scales = {1, 1};  ///< on the sigmas of each surface field

 private:
  struct UsedBeam {
    Vector3d direction;
    double range;      // infinite: no return
    double tau;        // s after the scan's mean time
    double sigma;      // m
    double intensity;  // 0: unknown
    // m, mean of the footprint's ranges about the middle ray's, and of those on the front face of
    // an edge that the middle ray passes, about where that face would go on.
    double mixed = 0;
    double mixed_front = 0;
    bool footprint_known = false;  // of footprints_at_
    bool returned() const { return range < std::numeric_limits<double>::infinity(); }
  };
  /// Patches of an edge sample, of its front face and of the face behind.
  struct RimPatches {
    int rim = -1;
    int front = -1;
    int behind = -1;
    bool made = false;
  };
  /// The faces and edges that a beam may meet, by index.
  struct Association {
    std::uint32_t beam;
    int near = -1;    // the nearest occluding edge
    int across = -1;  // the nearest on the other side, of a strut or a slit
    int patch = -1;   // of the face that the beam met
    int piece = -1;
    SurfaceHit hit;  // of the state that was prepared
  };

  /// The state and offsets at which the likelihood is evaluated.
  struct EvaluationPoint {
    const ScanState& state;
    const Eigen::VectorXd& offsets;  // of patches, m
    Pose model_sensor;               // at the mean time
    bool still;
    std::vector<Pose> turned_since;  // of each joint, relative to the edge samples' angles

    double offset(int patch) const { return patch < 0 ? 0 : offsets[patch]; }
  };
  /// Regression of a local surface error on its patch's offset.
  struct PatchRegression {
    double effect = 0;
    double variance = 0;  // m^2
  };
  /// An occluding edge near a beam's axis. Model frame.
  struct Edge {
    const RimSample* rim = nullptr;
    int patch = -1;
    Vector3d point, outward;  // of the sample, as its part has turned since
    Vector3d apart;           // m, from the axis to the point
    Vector3d across;          // outward, square to the axis
    double inside = 0;        // m, of the axis
    double width = 0;         // m
    double at = 0;            // inside distance over width, offsets included: coverage is Phi(at)
    double effect = 0;        // of the patch's offset
  };
  /// A face that a beam may meet.
  struct Face {
    SurfaceHit hit;
    int patch = -1;
    double cosine = 1;            // of incidence, as far as slopes have a meaning
    double effect = 0;            // of the patch's offset
    double own_variance = 0;      // m^2, without annealing
    std::size_t share_bin = 0;    // of BeamShares::drop_out
    std::optional<double> white;  // BeamShares::white by this return's intensity
    ExpectedReturn expected;
  };
  /// The edges and faces that a beam may meet.
  struct BeamGeometry {
    Ray ray;
    std::array<std::optional<Edge>, 2> edges;
    Face front;
    std::optional<Face> opposite;  // on the other side of a slit
    std::optional<Face> behind;
  };
  /// A beam's contribution to the estimate of the shares.
  struct BeamRecord {
    BeamTerm term;
    bool returned;
    int piece;
    double expected;  // probability that the target is met
    double drop_out;
    std::size_t share_bin;
    std::optional<double> white;
    double square, variance;  // m^2, of the range before the front face
  };
  PatchRegression regress_on_patch(int patch, const SurfacePatch& own) const;
  Edge edge_at(const EvaluationPoint& at, int rim, const Ray& ray) const;
  Face face_at(const EvaluationPoint& at, const SurfaceHit& hit, int patch, double mixed,
               const UsedBeam& beam, const Ray& ray) const;
  /// Empty for a beam that no longer meets the target.
  std::optional<BeamGeometry> geometry_of(const EvaluationPoint& at, const Association& association,
                                          const Ray& ray, const SurfaceHit& hit) const;
  /// @param to_sensor rotation from the model when the beam was sent
  void observe(const EvaluationPoint& at, const Association& association, const BeamGeometry& sight,
               const Quaterniond& to_sensor, const BeamTerm& term,
               Observations& observations) const;
  void estimate_shares(const std::vector<BeamRecord>& beams, const std::vector<double>& as_modelled,
                       Linearised& result) const;

  /// m: bound of the displacement of any point of the target between two states.
  double max_displacement(const ScanState& a, const ScanState& b) const;
  /// rad: bound of the change of the direction from which the target or a part is seen.
  double max_view_change(const ScanState& a, const ScanState& b) const;
  Pose pose_of(const UsedBeam& beam, const ScanState& state) const;
  Ray ray_of(const UsedBeam& beam, const Pose& model_sensor) const;
  /// Intersection of a ray that passes an edge with the extended plane of its front face; of an
  /// oblique face the edge itself.
  SurfaceHit extended_face(const RimSample& rim, const Vector3d& rim_point, const Ray& ray,
                           const ScanState& state) const;
  void sample_footprints(const ScanState& state);

  const TargetScene& scene_;
  const BeamModel& beam_model_;
  ScanStateLayout layout_;
  Options options_;
  std::vector<UsedBeam> beams_;
  double spacing_ = 0;  // rad, between the beams used
  Vector3d middle_ = Vector3d::UnitZ();
  double cone_cosine_ = 1;
  double half_duration_ = 0;  // s, about the mean time

  // Beams that may meet the target or an edge of it within that reach (m) of a state.
  std::vector<std::uint32_t> candidates_;
  ScanState candidates_at_;
  double candidates_reach_ = -1;
  int candidates_thinning_ = 0;

  // Of the stage.
  Stage stage_;
  ScanState prepared_at_;
  ScanState footprints_at_;
  double rim_width_ = 0;
  double rim_reach_ = 0;
  std::vector<Surface> surface_of_face_;
  std::vector<RimSample> rims_;
  ScanState rims_at_;
  int rims_thinning_ = 0;
  std::vector<RimPatches> rim_patches_;
  std::vector<SurfacePatch> patches_;
  std::vector<Association> associations_;
  int pieces_ = 0;
};

}  // namespace berth::estimator
