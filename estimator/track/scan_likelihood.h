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

/// What one scan is explained by. Vectors of it are [pose (6); velocity (6, where it is unknown);
/// rim offset; range bias (1, where the scanner may have one); joint angles], pose and velocity as
/// berth::perturbed(Motion).
struct ScanState {
  Motion motion;          ///< T_sensor_model and its velocity at the scan's mean time, sensor frame
  double rim_offset = 0;  ///< m by which all occluding edges seem to stand farther out
  double range_bias = 0;  ///< m, in every range
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

/// How wide the likelihood of beams is made, so that a pose far off is drawn in.
struct Annealing {
  double range = 0;  ///< m, 1 sigma, added to a range's
  double rim = 0;    ///< m, added to the width of occluding edges
};

/// The log-likelihood of the beams of one scan as a function of a ScanState and of the offsets of
/// the surface's patches, linearised where it is asked for. First prepare(), which decides by the
/// state given what beams may meet: patches, occluding edges, what needs no look again. Between two
/// prepare() it is one smooth function but for changes of the face that a beam meets.
class ScanFit {
 public:
  struct Options {
    int thinning = 1;                    ///< every so many-th beam is used, in an order of place
    double cells = 3;                    ///< patches along a correlation length
    double part_cell = 0.4;              ///< m, of pieces that are as modelled, or elsewhere
    double elsewhere = 0.02;             ///< probability of that
    Vector3d centre = Vector3d::Zero();  ///< m, of the sphere that holds the target, model frame
    double extent = 3;                   ///< m, its diameter: over which stray ranges are spread
    double radius = 3;                   ///< m, of the sphere that holds it, joints turned
    double depth = edge_depth;           ///< m: an edge occludes what is so much farther
  };
  /// How far the true surface is from the mesh, as described: standard deviation, and the distance
  /// over which it is alike.
  struct Surface {
    double sigma = 0;               ///< m
    double correlation_length = 1;  ///< m
    double reflectivity = 0.5;      ///< diffuse, 0..1
  };

  /// Scene and beam model must outlive the fit. layout: what is unknown of a state.
  ScanFit(const TargetScene& scene, const BeamModel& beam_model, const CleanScan& scan,
          const ScanStateLayout& layout, const Options& options);

  struct Stage {
    Annealing annealing;
    bool patches = false;  ///< the surface may be off
    bool pieces = false;   ///< pieces of it may be elsewhere
    int thinning = 1;  ///< every so many-th beam, in an order in which neighbours are neighbours
  };
  /// Looks at what beams may meet at a state. @param surface_of_face one for each face of the scene
  void prepare(const ScanState& state, const Stage& stage,
               const std::vector<Surface>& surface_of_face);

  /// The likelihood about one state.
  struct Linearised {
    double log_likelihood = 0;
    double log_likelihood_without = 0;  ///< of the same beams, if there were no target
    NormalEquations sums;               ///< e is at zero offsets
    // Expected numbers of beams.
    double returns = 0;    ///< inside the gate, of beams that may meet the target
    double explained = 0;  ///< of those, from a face as modelled
    /// Beams that should return from the target, each with the probability that it meets it as its
    /// weight: what only grazes an edge tells little of how the pose fits.
    double expected = 0;
    double fit = 0;           ///< of `expected`, those that did, as modelled
    double square_sum = 0;    ///< m^2: sum of e^2 over `explained`, offsets taken off
    double variance_sum = 0;  ///< m^2: of what that should be, without annealing
    BeamShares shares;        ///< as these beams say (one step of expectation maximisation)
  };
  /// @param offsets one for each of patches(), m
  Linearised linearise(const ScanState& state, const Eigen::VectorXd& offsets) const;

  const std::vector<SurfacePatch>& patches() const { return patches_; }
  BeamShares shares;            ///< of the next linearise()
  double noise_scale = 1;       ///< on the range sigma
  FieldScales scales = {1, 1};  ///< on the sigmas of the surface, of each field

 private:
  struct FitBeam {
    Vector3d direction;
    double range;      // infinite: nothing returned
    double tau;        // s after the scan's mean time
    double sigma;      // m
    double intensity;  // 0: says nothing
    // m, mean of the footprint's ranges about the middle ray's, and of those on the front face of
    // an edge that the middle ray passes, about where that face would go on.
    double mixed = 0;
    double mixed_front = 0;
    bool footprint_known = false;  // of footprints_at_
    bool returned() const { return range < std::numeric_limits<double>::infinity(); }
  };
  /// Patches of a rim, of the face in front of it and of the one behind.
  struct RimPatches {
    int rim = -1;
    int front = -1;
    int behind = -1;
    bool made = false;
  };
  struct Active {
    std::uint32_t beam;
    int near = -1;    // the nearest occluding edge
    int across = -1;  // the nearest on the other side, of a strut or a slit
    int patch = -1;   // of the face that the beam met
    int piece = -1;
    SurfaceHit hit;  // of the state that was prepared
  };

  /// Where the likelihood is taken.
  struct Place {
    const ScanState& state;
    const Eigen::VectorXd& offsets;  // of patches, m
    Pose model_sensor;               // at the mean time
    bool still;
    std::vector<Pose> turned_since;  // of each joint, since edges were found

    double offset(int patch) const { return patch < 0 ? 0 : offsets[patch]; }
  };
  struct Follows {
    double effect = 0;
    double variance = 0;  // m^2
  };
  /// An occluding edge beside a beam's axis. Model frame.
  struct Edge {
    const RimSample* rim = nullptr;
    int patch = -1;
    Vector3d point, outward;  // of the sample, as its part has turned since
    Vector3d apart;           // m, from the axis to the point
    Vector3d across;          // outward, square to the axis
    double inside = 0;        // m, of the axis
    double width = 0;         // m
    double at = 0;            // the axis, inside the edge as it is offset, in widths
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
    std::optional<double> white;  // see BeamShares, as this return's intensity has it
    ExpectedReturn expected;
  };
  /// What a beam may meet.
  struct Sight {
    Ray ray;
    std::array<std::optional<Edge>, 2> edges;
    Face front;
    std::optional<Face> beside;  // on the other side of a slit
    std::optional<Face> behind;
  };
  /// What shares are counted from.
  struct Explained {
    BeamTerm term;
    bool returned;
    int piece;
    double expected;  // probability that the target is met
    double drop_out;
    std::size_t share_bin;
    std::optional<double> white;
    double square, variance;  // m^2, of the range before the front face
  };
  Follows follows(int patch, const SurfacePatch& own) const;
  Edge edge_at(const Place& at, int rim, const Ray& ray) const;
  Face face_at(const Place& at, const SurfaceHit& hit, int patch, double mixed, const FitBeam& beam,
               const Ray& ray) const;
  /// Nothing, of a beam that is not before the target any more.
  std::optional<Sight> sight_of(const Place& at, const Active& active, const Ray& ray,
                                const SurfaceHit& hit) const;
  /// @param to_sensor from the model, when the beam was sent
  void observe(const Place& at, const Active& active, const Sight& sight,
               const Quaterniond& to_sensor, const BeamTerm& term,
               Observations& observations) const;
  void count(const std::vector<Explained>& beams, const std::vector<double>& as_modelled,
             Linearised& result) const;

  /// m by which any place of the target may have moved between two states, at most.
  double moved_between(const ScanState& a, const ScanState& b) const;
  /// rad by which the direction has turned that the target, or a part of it, is seen from.
  double turned_between(const ScanState& a, const ScanState& b) const;
  Pose pose_of(const FitBeam& beam, const ScanState& state) const;
  Ray ray_of(const FitBeam& beam, const Pose& model_sensor) const;
  /// The face in front of an edge where a ray that passes it would meet it, were it larger; of an
  /// oblique one the edge.
  SurfaceHit continued(const RimSample& rim, const Vector3d& rim_point, const Ray& ray,
                       const ScanState& state) const;
  void look_at_footprints(const ScanState& state);

  const TargetScene& scene_;
  const BeamModel& beam_model_;
  ScanStateLayout layout_;
  Options options_;
  std::vector<FitBeam> beams_;
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
  std::vector<Active> active_;
  int pieces_ = 0;
};

}  // namespace berth::estimator
