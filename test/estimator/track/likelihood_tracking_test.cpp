// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/likelihood_tracking.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "estimator/track/scan_likelihood.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

double integral(double low, double high, const std::function<double(double)>& f) {
  constexpr int steps = 20000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += f(low + (high - low) * (i + 0.5) / steps);
  return sum * (high - low) / steps;
}

/// Patches on a bent plate and observations of them, at random.
struct Plate {
  std::vector<SurfacePatch> patches;
  NormalEquations sums;
  Eigen::MatrixXd jacobian;  // a row for each observation
  Eigen::VectorXd weights, residuals, effects;
  std::vector<int> patch_of;

  explicit Plate(Random random) {
    for (int i = 0; i < 12; ++i) {
      const double angle = 0.2 * (i % 3);
      patches.push_back({{0.15 * i, 0.1 * (i % 3), 0},
                         {std::sin(angle), 0, std::cos(angle)},
                         i < 8 ? 0.008 : 0.002,
                         i < 8 ? 0.3 : 0.2,
                         i % 4 == 3,
                         i % 4 == 3 ? 1 : 1 + 0.1 * i});
    }
    constexpr int observations = 60;
    constexpr int size = 3;
    jacobian.resize(observations, size);
    weights.resize(observations);
    residuals.resize(observations);
    effects.resize(observations);
    for (int i = 0; i < observations; ++i) {
      for (int k = 0; k < size; ++k) jacobian(i, k) = random.normal();
      weights[i] = std::pow(0.01, -2) * random.uniform(0.5, 1);
      residuals[i] = random.normal(0.01);
      effects[i] = -random.uniform(0.5, 2);
      patch_of.push_back(i % 12);
    }
    sum_up();
  }

  void sum_up() {
    const auto n = static_cast<Eigen::Index>(patches.size());
    sums.information = jacobian.transpose() * weights.asDiagonal() * jacobian;
    sums.gradient = jacobian.transpose() * weights.cwiseProduct(residuals);
    sums.patch_information = Eigen::VectorXd::Zero(n);
    sums.patch_gradient = Eigen::VectorXd::Zero(n);
    sums.coupling = Eigen::MatrixXd::Zero(n, jacobian.cols());
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      const int p = patch_of[static_cast<std::size_t>(i)];
      sums.patch_information[p] += weights[i] * effects[i] * effects[i];
      sums.patch_gradient[p] += weights[i] * effects[i] * residuals[i];
      sums.coupling.row(p) += weights[i] * effects[i] * jacobian.row(i);
    }
  }

  Eigen::MatrixXd covariance_of_offsets(const FieldScales& scales = {1, 1}) const {
    const auto n = static_cast<Eigen::Index>(patches.size());
    Eigen::MatrixXd k(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        k(i, j) = 0;
        const SurfacePatch& a = patches[static_cast<std::size_t>(i)];
        const SurfacePatch& b = patches[static_cast<std::size_t>(j)];
        for (std::size_t f = 0; f < surface_fields.size(); ++f) {
          k(i, j) += scales[f] * scales[f] * offset_covariance(surface_fields[f], a, b);
        }
        CHECK(offset_covariance(scales, a, b) == Approx(k(i, j)).margin(1e-15));
      }
    }
    return k;
  }
  /// a, as a matrix: observations x patches.
  Eigen::MatrixXd spread() const {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(weights.size(), 12);
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      a(i, patch_of[static_cast<std::size_t>(i)]) = effects[i];
    }
    return a;
  }
  Eigen::MatrixXd covariance_of_residuals(const FieldScales& scales) const {
    Eigen::MatrixXd c = spread() * covariance_of_offsets(scales) * spread().transpose();
    c.diagonal() += weights.cwiseInverse();
    return c;
  }
};

}  // namespace

TEST_CASE("The probabilities of what a beam may read sum up to one") {
  BeamShares shares;
  shares.outlier = 0.1;
  constexpr double depth = 3;
  const double coverage = GENERATE(0.0, 0.3, 1.0);
  const bool slit = GENERATE(false, true);
  const bool backed = GENERATE(false, true);
  const double neighbour_coverage = slit ? 0.4 * (1 - coverage) : 0;
  const auto term = [&](bool returned, double range) {
    const ExpectedReturn front{range - 1.2, 1e-4, 0.05, 1, coverage};
    const ExpectedReturn neighbour{range - 1.4, 1e-4, 0.1, 1, neighbour_coverage};
    const ExpectedReturn behind{range - 1.7, 2e-4, 0.2};
    return std::exp(beam_term(returned, front, slit ? std::optional(neighbour) : std::nullopt,
                              backed ? std::optional(behind) : std::nullopt, shares, depth)
                        .log_likelihood);
  };
  // Stray ranges are spread over one depth, those of the background over two.
  double sum = term(false, 0) + integral(0, depth, [&](double z) { return term(true, z); });
  if (!backed) {
    sum += (1 - coverage - neighbour_coverage) * integral(depth, 2 * depth, [&](double) {
             return (1 - shares.outlier) * shares.background / (2 * depth);
           });
  }
  CHECK(sum == Approx(1).epsilon(1e-3));
}

TEST_CASE("The score of a beam is the derivative of its likelihood") {
  const bool returned = GENERATE(true, false);
  const bool backed = GENERATE(true, false);
  const bool slit = GENERATE(true, false);
  const double coverage = GENERATE(0.02, 0.5, 0.97);
  const double off = GENERATE(-0.03, 0.005, 0.03);
  const auto at = [&](double d_coverage, double d_neighbour, double d_range) {
    const double range = off + d_range;
    const ExpectedReturn front{range, 1e-4, 0.05, 1, coverage + d_coverage};
    const ExpectedReturn neighbour{range - 0.02, 2e-4, 0.2, 1, 0.7 * (1 - coverage) + d_neighbour};
    const ExpectedReturn behind{range - 0.04, 3e-4, 0.1};
    return beam_term(returned, front, slit ? std::optional(neighbour) : std::nullopt,
                     backed ? std::optional(behind) : std::nullopt, {}, 3);
  };
  const BeamTerm term = at(0, 0, 0);
  constexpr double step = 1e-6;
  const auto slope = [&](double d_coverage, double d_neighbour, double d_range) {
    return (at(d_coverage, d_neighbour, d_range).log_likelihood -
            at(-d_coverage, -d_neighbour, -d_range).log_likelihood) /
           (2 * step);
  };
  CHECK(term.coverage_score == Approx(slope(step, 0, 0)).epsilon(1e-5));
  if (slit) CHECK(term.opposite_score == Approx(slope(0, step, 0)).epsilon(1e-5));
  const double expected = -term.front * off / 1e-4 - term.opposite * (off - 0.02) / 2e-4 -
                          term.behind * (off - 0.04) / 3e-4;
  CHECK(slope(0, 0, step) == Approx(expected).epsilon(1e-4).margin(1e-6));
}

TEST_CASE("The covariance of offsets as factors is the covariance, as far as asked") {
  const Plate plate(Random(1, "plate"));
  const OffsetCovariance exact(plate.patches, plate.sums, {1, 1}, 0);
  const FieldScales scales = {0.5, 2};
  const OffsetCovariance coarse(plate.patches, plate.sums, scales, 0.05);
  for (std::size_t f = 0; f < surface_fields.size(); ++f) {
    FieldScales alone = {0, 0};
    alone[f] = 1;
    const Eigen::MatrixXd k = plate.covariance_of_offsets(alone);
    const Eigen::MatrixXd& l = exact.fields[f].factor;
    CHECK((l * l.transpose()).isApprox(k, 1e-9));
    const Eigen::MatrixXd& few = coarse.fields[f].factor;
    CHECK(few.cols() <= l.cols());
    const Eigen::MatrixXd left = k - few * few.transpose();
    CHECK((left.diagonal() - coarse.fields[f].residual).norm() < 1e-12);
    const Eigen::VectorXd noises =
        scales[f] * scales[f] *
        coarse.fields[f].residual.cwiseProduct(plate.sums.patch_information);
    CHECK(noises.maxCoeff() <= 0.05);
    CHECK(Eigen::LLT<Eigen::MatrixXd>(k + 1e-12 * Eigen::MatrixXd::Identity(12, 12)).info() ==
          Eigen::Success);
  }
}

TEST_CASE("Offsets are marginalised as generalised least squares has it") {
  const Plate plate(Random(2, "plate"));
  const double tolerance = GENERATE(0.0, 0.03);
  const double scale = 1.5;
  const OffsetCovariance covariance(plate.patches, plate.sums, {scale, scale}, tolerance);
  MarginalisedEquations equations(plate.sums, covariance, {scale, scale});
  if (tolerance == 0 && GENERATE(false, true)) {
    equations = MarginalisedEquations(plate.sums, covariance, {0.1, 3});
    equations.rescale({scale, scale});
  }
  const Eigen::LLT<Eigen::MatrixXd> residuals(plate.covariance_of_residuals({scale, scale}));
  const double within = tolerance == 0 ? 1e-9 : 0.02;
  const Eigen::MatrixXd information = plate.jacobian.transpose() * residuals.solve(plate.jacobian);
  const Eigen::VectorXd gradient = plate.jacobian.transpose() * residuals.solve(plate.residuals);
  CHECK(equations.information().isApprox(information, within));
  CHECK(equations.gradient().isApprox(gradient, within));
  const Eigen::VectorXd x = information.ldlt().solve(gradient);
  const Eigen::MatrixXd k = plate.covariance_of_offsets({scale, scale});
  const Eigen::VectorXd delta =
      k * plate.spread().transpose() * residuals.solve(plate.residuals - plate.jacobian * x);
  if (tolerance == 0) {
    CHECK(equations.offsets(x).isApprox(delta, 1e-6));
    CHECK(equations.offsets_squared(x) == Approx(delta.dot(k.ldlt().solve(delta))).epsilon(1e-4));
  } else {
    CHECK((equations.offsets(x) - delta).norm() < 0.1 * delta.norm());
  }
}

TEST_CASE("A field's evidence has the slope that numeric differences have") {
  const Plate plate(Random(3, "plate"));
  const OffsetCovariance covariance(plate.patches, plate.sums, {1, 1}, 0);
  // -log of the residuals' probability with x and offsets marginalised, but for constants.
  const auto cost = [&](const FieldScales& scales) {
    const Eigen::LLT<Eigen::MatrixXd> solver(plate.covariance_of_residuals(scales));
    const Eigen::MatrixXd information = plate.jacobian.transpose() * solver.solve(plate.jacobian);
    const Eigen::VectorXd gradient = plate.jacobian.transpose() * solver.solve(plate.residuals);
    const Eigen::MatrixXd l = solver.matrixL();
    return 0.5 * plate.residuals.dot(solver.solve(plate.residuals)) -
           0.5 * gradient.dot(information.ldlt().solve(gradient)) +
           l.diagonal().array().log().sum() + 0.5 * std::log(information.determinant());
  };
  for (const FieldScales& scales :
       {FieldScales{0.3, 0.3}, FieldScales{1, 2}, FieldScales{2, 0.5}}) {
    const MarginalisedEquations equations(plate.sums, covariance, scales);
    const Eigen::MatrixXd p = equations.information().inverse();
    const auto evidence = equations.evidence(p, p * equations.gradient());
    for (std::size_t f = 0; f < scales.size(); ++f) {
      constexpr double step = 1e-4;
      FieldScales more = scales;
      FieldScales less = scales;
      more[f] *= std::exp(step);
      less[f] *= std::exp(-step);
      const double slope = (cost(less) - cost(more)) / (2 * step);
      CHECK(evidence[f].squared - evidence[f].well_determined ==
            Approx(slope).epsilon(1e-3).margin(1e-3));
    }
  }
}

TEST_CASE("Errors of draws are consistent with the marginalised information") {
  Plate plate(Random(4, "plate"));
  Random random(5, "draws");
  const OffsetCovariance covariance(plate.patches, plate.sums, {1, 1}, 0);
  const MarginalisedEquations equations(plate.sums, covariance, {1, 1});
  const Eigen::MatrixXd p = equations.information().inverse();
  const Eigen::MatrixXd k = plate.covariance_of_offsets();
  const Eigen::MatrixXd root = (k + 1e-12 * Eigen::MatrixXd::Identity(12, 12)).llt().matrixL();
  double sum = 0;
  constexpr int draws = 2000;
  for (int i = 0; i < draws; ++i) {
    Eigen::VectorXd z(12);
    for (double& v : z) v = random.normal();
    plate.residuals = plate.spread() * (root * z);
    for (Eigen::Index j = 0; j < plate.weights.size(); ++j) {
      plate.residuals[j] += random.normal(1 / std::sqrt(plate.weights[j]));
    }
    plate.sum_up();
    const MarginalisedEquations drawn(plate.sums, covariance, {1, 1});
    const Eigen::VectorXd x = p * drawn.gradient();
    sum += x.dot(drawn.information() * x);
  }
  CHECK(sum / draws == Approx(3).margin(4 * std::sqrt(6.0 / draws)));
}

namespace {

/// A body with a panel that turns about a hinge, a strut, and a box behind.
Target hinged_target() {
  Mesh mesh = make_box({0.8, 0.8, 0.6});
  const std::size_t body = mesh.triangles.size();
  mesh.append(make_box({1.2, 0.5, 0.03}), {{1.1, 0, 0.1}, Quaterniond::Identity()});
  const std::size_t panel = mesh.triangles.size();
  mesh.append(make_strut({-0.4, 0, 0}, {-1.2, 0.4, 0.2}, 0.02));
  Target target = described(mesh);
  target.name = "hinged";
  std::fill(target.part_of.begin() + static_cast<std::ptrdiff_t>(body),
            target.part_of.begin() + static_cast<std::ptrdiff_t>(panel), std::uint16_t{1});
  target.parts.resize(2);
  for (TargetPart& part : target.parts) part.surface_sigma = 1e-4;
  target.parts[1].name = "panel";
  target.parts[1].joint = Joint{Vector3d::UnitY(), {0.45, 0, 0.1}, -radians(20), radians(20), 0};
  return target;
}

const Pose hinged_pose{{0.1, -0.05, 4.5}, rotation_from_vector({0.4, 0.5, 0.1})};

PreprocessedScan scan_of(const Mesh& mesh, const Pose& pose, int count, std::uint64_t seed,
                         const Velocity& velocity = {}) {
  ScanMaker lidar(mesh, seed);
  lidar.pose = pose;
  lidar.velocity = velocity;
  return preprocess(sweep_around(lidar, mesh, count), {}, nominal_beam);
}

Prediction prediction_off(const Pose& truth, double metres, double angle, Random& random) {
  Prediction predicted;
  Vector6d step;
  step.head<3>() = metres * random.normal_vector(1).normalized();
  step.tail<3>() = angle * random.normal_vector(1).normalized();
  predicted.pose = perturbed(truth, step);
  predicted.covariance = Matrix6d::Zero();
  predicted.covariance.diagonal().head<3>().setConstant(metres * metres / 3);
  predicted.covariance.diagonal().tail<3>().setConstant(angle * angle / 3);
  return predicted;
}

}  // namespace

TEST_CASE("A part turned by casting and a part turned in the mesh are the same") {
  const Target target = hinged_target();
  const TargetScene scene(target);
  REQUIRE(scene.joints().size() == 1);
  const double angle = radians(12);
  const RayCaster turned_caster(turned_mesh(target, {0, angle}));
  Random random(1, "rays");
  int met = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d from = 5 * random.normal_vector(1).normalized();
    const Vector3d to = random.normal_vector(0.5);
    const Ray ray{from, (to - from).normalized()};
    SurfaceHit hit;
    scene.cast({angle}, {&ray, 1}, 100, {&hit, 1});
    RayHit expected;
    const bool hits = turned_caster.cast(ray, 100, expected);
    REQUIRE(hit.met() == hits);
    if (!hits) continue;
    ++met;
    CHECK(hit.range == Approx(expected.range).margin(1e-5));
    CHECK(hit.normal.dot(expected.normal) == Approx(1).margin(1e-6));
    CHECK(scene.meet({angle}, ray, hit.face).range == Approx(hit.range).margin(1e-5));
  }
  CHECK(met > 100);
}

TEST_CASE("The sphere about a target holds it however its joint stands") {
  const Target target = hinged_target();
  const TargetScene scene(target);
  const Vector3d centre(0.2, -0.1, 0.3);
  double farthest = 0;
  for (int degree = 0; degree < 360; ++degree) {
    for (const Vector3d& vertex : turned_mesh(target, {0, radians(degree)}).vertices) {
      farthest = std::max(farthest, (vertex - centre).norm());
    }
  }
  CHECK(farthest <= scene.radius_about(centre) + 1e-12);
  CHECK(scene.radius_about(centre) == Approx(farthest).epsilon(1e-4));
}

TEST_CASE("Occluding edges are where rays on one side pass") {
  const Target target = hinged_target();
  const TargetScene scene(target);
  const Vector3d eye(0.3, 0.5, -5);
  const auto rims = scene.rims({0.1}, eye, -eye.normalized(), 0.5, 0.005, 0.03);
  CHECK(rims.size() > 100);
  for (const RimSample& rim : rims) {
    const auto range = [&](double aside) {
      const Ray ray{eye, (rim.point + aside * rim.outward - eye).normalized()};
      SurfaceHit hit;
      scene.cast({0.1}, {&ray, 1}, 100, {&hit, 1});
      return hit.range;
    };
    const double at = (rim.point - eye).norm();
    CHECK(range(-0.0005) == Approx(at).margin(0.03));
    CHECK(range(0.0007) > at + 0.029);
  }
}

TEST_CASE("Struts, slits and mixed pixels agree with the integral over a beam's footprint") {
  // A strut along x, or a slit, before a wall, or before nothing. A beam is a bundle of rays,
  // normally distributed about its middle, of which the receiver takes one.
  const bool wall = GENERATE(false, true);
  const bool slit = GENERATE(false, true);
  constexpr double half = 0.008;
  constexpr double strut_range = 5;
  constexpr double wall_range = 5.2;
  Target target;
  if (slit) {
    for (const double side : {-1.0, 1.0}) {
      target.mesh.append(make_box({2, 1, 0.002}),
                         {{0, side * (half + 0.5), 0}, Quaterniond::Identity()});
    }
  } else {
    target.mesh = make_box({2, 2 * half, 0.002});
  }
  if (wall) target.mesh.append(make_box({3, 3, 0.002}), {{0, 0, 0.2}, Quaterniond::Identity()});
  target.parts.front().surface_sigma = 0;
  const TargetScene scene(target);
  BeamModel noise;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 0;
  const double width = 0.25 * noise.footprint(strut_range);
  ScanState state;
  state.motion.pose.position = {0, 0, strut_range + 0.001};
  const std::vector<ScanLikelihood::Surface> surfaces(target.mesh.triangles.size(), {0, 0.3});
  for (const double aside : {-0.013, -0.009, -0.006, 0.0, 0.005, 0.0079, 0.011}) {
    for (const double range :
         {std::numeric_limits<double>::infinity(), strut_range + 0.004, wall_range - 0.01}) {
      // Two equal beams, side by side along the strut.
      PreprocessedScan scan;
      for (const double along : {-0.005, 0.005}) {
        Beam beam;
        beam.direction = Vector3d(along, aside, strut_range).normalized();
        beam.range = range;
        scan.beams.push_back(beam);
      }
      ScanLikelihood fit(scene, noise, scan, {}, {});
      fit.prepare(state, {{1e-9, 0}, false, false}, surfaces);
      const BeamShares& shares = fit.shares;
      const ScanLikelihood::Options options;
      const double found = fit.linearise(state, {}).log_likelihood / 2;
      const auto of_face = [&](double at) {
        const double p_d = shares.drop_out_at(1);
        if (!std::isfinite(range)) return p_d;
        const double off = (range - at) / noise.range_sigma_m;
        return (1 - p_d - shares.outlier) * std::exp(-0.5 * off * off) /
                   (std::sqrt(2 * M_PI) * noise.range_sigma_m) +
               shares.outlier / options.extent;
      };
      const double background =
          std::isfinite(range) ? (1 - shares.outlier) * shares.background / (2 * options.extent) +
                                     shares.outlier / options.extent
                               : (1 - shares.outlier) * (1 - shares.background);
      const double expected = integral(-8 * width, 8 * width, [&](double off) {
        const double weight =
            std::exp(-0.5 * off * off / (width * width)) / (std::sqrt(2 * M_PI) * width);
        const bool within = std::abs(aside + off) < half;
        if (within != slit) return weight * of_face(strut_range);
        return weight * (wall ? of_face(wall_range) : background);
      });
      CAPTURE(wall, slit, aside, range);
      CHECK(found == Approx(std::log(expected)).margin(0.03));
    }
  }
}

TEST_CASE("A slit that seems closed has no information on its width") {
  // As seen by beams that come back from the wall behind it, the edges offset so that they meet.
  constexpr double half = 0.002;
  const double farther = GENERATE(0.0, 0.3);  // m, of one of its sides
  Target target;
  target.mesh.append(make_box({2, 1, 0.002}), {{0, half + 0.5, 0}, Quaterniond::Identity()});
  target.mesh.append(make_box({2, 1, 0.002}), {{0, -half - 0.5, farther}, Quaterniond::Identity()});
  target.mesh.append(make_box({3, 3, 0.002}), {{0, 0, 1}, Quaterniond::Identity()});
  const TargetScene scene(target);
  PreprocessedScan scan;
  for (const double along : {-0.005, 0.005}) {
    Beam beam;
    beam.direction = Vector3d(along, 0.0003, 5).normalized();
    beam.range = 6;
    scan.beams.push_back(beam);
  }
  const ScanStateLayout layout;
  ScanLikelihood fit(scene, nominal_beam, scan, layout, {});
  ScanState state;
  state.motion.pose.position = {0, 0, 5};
  fit.prepare(state, {},
              std::vector<ScanLikelihood::Surface>(target.mesh.triangles.size(), {0, 0.3}));
  for (const double offset : {0.0, 0.0015, 0.0025, 0.004}) {
    state.rim_offset = offset;
    CAPTURE(farther, offset);
    const auto at = fit.linearise(state, {});
    constexpr double step = 1e-6;
    Eigen::VectorXd d = Eigen::VectorXd::Zero(layout.size());
    d[layout.rim_at()] = step;
    const double slope = (fit.linearise(layout.moved(state, d), {}).log_likelihood -
                          fit.linearise(layout.moved(state, -d), {}).log_likelihood) /
                         (2 * step);
    CHECK(at.sums.gradient[layout.rim_at()] == Approx(slope).epsilon(0.01).margin(0.1));
    if (offset <= half) continue;
    const double width = 0.25 * nominal_beam.footprint(5);
    CHECK(at.sums.information(layout.rim_at(), layout.rim_at()) < 2 / (width * width));
  }
}

TEST_CASE("The gradient of a scan's likelihood is that of numeric differences") {
  const Target target = hinged_target();
  const TargetScene scene(target);
  const bool moving = GENERATE(false, true);
  const Velocity velocity = moving ? Velocity{{0.02, 0, 0.01}, {0, 0.05, 0.03}} : Velocity{};
  const PreprocessedScan scan = scan_of(target.mesh, hinged_pose, 1500, 3, velocity);
  ScanStateLayout layout;
  layout.velocity = layout.range_bias = true;
  layout.joints = 1;
  ScanLikelihood::Options options;
  BeamModel noise = nominal_beam;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 0;  // by which variances vary with the pose
  ScanLikelihood fit(scene, noise, scan, layout, options);
  ScanState state;
  state.motion = {hinged_pose, velocity};
  state.angles = {0};
  Eigen::VectorXd off(layout.size());
  off << 0.004, -0.003, 0.005, 0.002, -0.003, 0.002, 0.002, 0.001, -0.002, 0.001, 0.002, -0.001,
      0.001, 0.003, 0.01;
  state = layout.moved(state, off);
  const std::vector<ScanLikelihood::Surface> surfaces(target.mesh.triangles.size(), {0, 1e6});
  fit.prepare(state, {{0.02, 0.02}, false, true}, surfaces);
  const Eigen::VectorXd none;
  const ScanLikelihood::Linearised here = fit.linearise(state, none);
  const Eigen::VectorXd& gradient = here.sums.gradient;
  for (int k = 0; k < layout.size(); ++k) {
    constexpr double step = 2e-5;
    Eigen::VectorXd d = Eigen::VectorXd::Zero(layout.size());
    d[k] = step;
    const auto slope_to = [&](double sign) {
      const auto there = fit.linearise(layout.moved(state, sign * d), none);
      return sign * (there.log_likelihood - here.log_likelihood) / step;
    };
    // The face that a beam meets may change on one side: the likelihood jumps there.
    const double forward = slope_to(1);
    const double backward = slope_to(-1);
    const double slope =
        std::abs(forward - gradient[k]) < std::abs(backward - gradient[k]) ? forward : backward;
    CAPTURE(k);
    CHECK(gradient[k] == Approx(slope).epsilon(0.02).margin(2e-3 * gradient.norm()));
  }
}

TEST_CASE("The gradient for the surface's offsets is that of numeric differences") {
  const Target target = hinged_target();
  const TargetScene scene(target);
  const PreprocessedScan scan = scan_of(target.mesh, hinged_pose, 1500, 3);
  ScanStateLayout layout;
  layout.joints = 1;
  ScanLikelihood fit(scene, nominal_beam, scan, layout, {});
  ScanState state;
  state.motion.pose = hinged_pose;
  state.angles = {0};
  fit.prepare(state, {{0.01, 0.01}, true, true},
              std::vector<ScanLikelihood::Surface>(target.mesh.triangles.size(), {0.004, 0.3}));
  const auto count = static_cast<Eigen::Index>(fit.patches().size());
  REQUIRE(count > 30);
  Random random(2, "offsets");
  Eigen::VectorXd offsets(count);
  for (double& v : offsets) v = random.normal(0.003);
  const auto at = fit.linearise(state, offsets);
  const Eigen::VectorXd gradient =
      at.sums.patch_gradient - at.sums.patch_information.cwiseProduct(offsets);
  for (Eigen::Index k = 0; k < count; k += 5) {
    constexpr double step = 1e-5;
    Eigen::VectorXd d = Eigen::VectorXd::Zero(count);
    d[k] = step;
    const double slope = (fit.linearise(state, offsets + d).log_likelihood -
                          fit.linearise(state, offsets - d).log_likelihood) /
                         (2 * step);
    CHECK(gradient[k] == Approx(slope).epsilon(0.01).margin(1e-3 * gradient.norm()));
  }
}

TEST_CASE("The likelihood's tracking finds pose and joint, with a consistent covariance") {
  const Target target = hinged_target();
  const auto model = coarse_model(target);
  const LikelihoodTracking tracking(*model, nominal_beam, {});
  const double angle = GENERATE(0.0, -10.0, 14.0);
  const Mesh real = turned_mesh(target, {0, radians(angle)});
  double nees = 0;
  constexpr int trials = 12;
  for (int i = 0; i < trials; ++i) {
    Random random(static_cast<std::uint64_t>(i), "tracking");
    const PreprocessedScan scan =
        scan_of(real, hinged_pose, 1500, static_cast<std::uint64_t>(i + 1));
    const auto result = tracking.track(scan, prediction_off(hinged_pose, 0.03, radians(2), random));
    REQUIRE(result.ok);
    const Vector6d error = difference(hinged_pose, result.pose);
    CHECK(error.head<3>().norm() < 0.004);
    CHECK(error.tail<3>().norm() < radians(0.4));
    nees += error.dot(result.covariance.ldlt().solve(error)) / trials;
  }
  // 6 on average; its standard error is 1 for these trials.
  CHECK(nees > 2.5);
  CHECK(nees < 10);
}

TEST_CASE("Tracking from the other side of a panel that is seen edge on finds the pose") {
  const Target target = hinged_target();
  const auto model = coarse_model(target);
  const LikelihoodTracking tracking(*model, nominal_beam, {});
  for (int i = 0; i < 24; ++i) {
    Random random(static_cast<std::uint64_t>(i), "edge on");
    const Pose truth =
        pose_from_xyzwpr({0, 0, 5000, 90 + random.uniform(-0.5, 0.5), 0, random.uniform(-90, 90)});
    const PreprocessedScan scan =
        scan_of(target.mesh, truth, 1500, static_cast<std::uint64_t>(i + 1));
    const auto result = tracking.track(scan, prediction_off(truth, 0.03, radians(2), random));
    const Vector6d error = difference(truth, result.pose);
    CAPTURE(i, 1e3 * error.head<3>().norm(), degrees(error.tail<3>().norm()), result.confidence);
    REQUIRE(result.ok);
    CHECK(error.dot(result.covariance.ldlt().solve(error)) < 50);
  }
}

TEST_CASE("An occluder of half of the target adds no information on it") {
  const Target target = hinged_target();
  const auto model = coarse_model(target);
  const LikelihoodTracking tracking(*model, nominal_beam, {});
  const Pose truth{{0, 0, 7}, hinged_pose.rotation};
  Mesh plate = make_box({0.4, 2, 0.01});
  for (Vector3d& vertex : plate.vertices) vertex += Vector3d(0.2, 0, 3.5);
  ScanMaker lidar(target.mesh, 3);
  lidar.pose = truth;
  lidar.add_clutter(plate);
  const PreprocessedScan scan =
      preprocess(sweep_around(lidar, target.mesh, 1500), {}, nominal_beam);
  const auto hidden = std::count_if(scan.points.begin(), scan.points.end(),
                                    [](const Vector3d& point) { return point.z() < 4; });
  REQUIRE(hidden > 300);
  Random random(1, "hidden");
  const auto result = tracking.track(scan, prediction_off(truth, 0.03, radians(2), random));
  REQUIRE(result.ok);
  CHECK(result.confidence > 0.9);
  const Vector6d error = difference(truth, result.pose);
  CHECK(error.dot(result.covariance.ldlt().solve(error)) < 25);
}

TEST_CASE("Neither the order of beams nor beams sent twice change what is tracked") {
  const Target target = hinged_target();
  const auto model = coarse_model(target);
  const LikelihoodTracking tracking(*model, nominal_beam, {});
  ScanMaker lidar(target.mesh, 4);
  lidar.pose = hinged_pose;
  std::vector<RawBeam> beams = sweep_around(lidar, target.mesh, 1200);
  Random random(1, "order");
  const Prediction predicted = prediction_off(hinged_pose, 0.02, radians(1), random);
  const auto first = tracking.track(preprocess(beams, {}, nominal_beam), predicted);
  std::reverse(beams.begin(), beams.end());
  const std::vector<RawBeam> once = beams;
  beams.insert(beams.end(), once.begin(), once.end());
  const auto second = tracking.track(preprocess(beams, {}, nominal_beam), predicted);
  REQUIRE(first.ok);
  REQUIRE(second.ok);
  CHECK(difference(first.pose, second.pose).norm() < 1e-9);
  CHECK(first.covariance.isApprox(second.covariance, 1e-6));

  // Another frame of the sensor turns the answer, and changes nothing else.
  const Quaterniond turn = rotation_from_vector({0.02, -0.03, 0.5});
  PreprocessedScan turned = preprocess(once, {}, nominal_beam);
  for (Beam& beam : turned.beams) beam.direction = turn * beam.direction;
  for (Vector3d& point : turned.points) point = turn * point;
  Prediction there = predicted;
  there.pose = Pose{Vector3d::Zero(), turn} * predicted.pose;
  const auto third = tracking.track(turned, there);
  REQUIRE(third.ok);
  const Vector6d apart = difference(Pose{Vector3d::Zero(), turn} * first.pose, third.pose);
  CHECK(apart.dot(third.covariance.ldlt().solve(apart)) < 0.05);
}

TEST_CASE("Returns that fit are counted whether a scan is thinned or not") {
  const Target target = hinged_target();
  const auto model = coarse_model(target);
  LikelihoodTrackingOptions thin;
  thin.max_returns = 300;
  const PreprocessedScan scan = scan_of(target.mesh, hinged_pose, 1500, 1);
  const auto used = [&](const LikelihoodTrackingOptions& options) {
    Random random(1, "thinned");
    const LikelihoodTracking tracking(*model, nominal_beam, options);
    const auto result = tracking.track(scan, prediction_off(hinged_pose, 0.02, 0.02, random));
    REQUIRE(result.ok);
    CHECK(result.used <= static_cast<int>(scan.points.size()));
    CHECK(result.used <= result.near);
    return result.used;
  };
  CHECK(used(thin) == Approx(used({})).epsilon(0.05));
}

TEST_CASE("A scan of nothing that the target explains is lost, with the reason") {
  const Target target = hinged_target();
  const auto model = coarse_model(target);
  const LikelihoodTracking tracking(*model, nominal_beam, {});
  Random random(1, "other");
  const PreprocessedScan scan =
      scan_of(make_box({2, 2, 0.5}), {{0, 0, 5}, hinged_pose.rotation}, 1500, 1);
  const auto result = tracking.track(scan, prediction_off(hinged_pose, 0.03, radians(2), random));
  CHECK_FALSE(result.ok);
  CHECK_THAT(result.reason, Catch::Contains("should meet the target"));
  CHECK_FALSE(
      tracking.track(PreprocessedScan{}, prediction_off(hinged_pose, 0.03, 0.02, random)).ok);
}

TEST_CASE("A return that is as bright as no face here is none of it") {
  // A bright plate with something dark stuck on that no mesh has, nearer by 1.5 sigma of a range.
  Target target = described(make_box({1.2, 0.9, 0.3}));
  target.parts.front().material = {0.8, 0};
  const auto model = coarse_model(target);
  const Pose truth{{0.1, -0.05, 4.5}, rotation_from_vector({0.2, 0.3, 0.1})};
  BeamModel beam_model = nominal_beam;
  const auto error_with = [&](double intensity_sigma) {
    beam_model.intensity_sigma = intensity_sigma;
    const LikelihoodTracking tracking(*model, beam_model, {});
    ScanMaker lidar(target.mesh, 1);
    lidar.pose = truth;
    std::vector<RawBeam> beams = sweep_around(lidar, target.mesh, 1500);
    Random random(1, "light");
    for (RawBeam& beam : beams) {
      if (beam.status != BeamStatus::hit) continue;
      beam.intensity = 1000 * std::exp(random.normal(0.2)) / (beam.range * beam.range);
      if (beam.azimuth < 0.06) continue;
      beam.range -= 0.015;
      beam.intensity *= 0.1;
    }
    const auto result = tracking.track(preprocess(beams, {}, beam_model),
                                       prediction_off(truth, 0.01, radians(0.5), random));
    CAPTURE(intensity_sigma, result.reason, difference(truth, result.pose).transpose());
    REQUIRE(result.ok);
    return difference(truth, result.pose).norm();
  };
  const double unlit = error_with(0);
  CHECK(unlit > 0.006);
  CHECK(error_with(0.3) < 0.5 * unlit);
}

TEST_CASE("Two returns of a beam locate an edge") {
  // Two plates behind each other; edges of the front one part the light of wide beams.
  Mesh mesh = make_box({0.6, 0.6, 0.02});
  mesh.append(make_box({1.4, 1.2, 0.02}), {{0.1, 0, 0.7}, Quaterniond::Identity()});
  Target target = described(mesh);
  target.parts.front().surface_sigma = 1e-4;
  const auto model = coarse_model(target);
  const Pose truth{{0.1, -0.05, 4.5}, rotation_from_vector({0.1, 0.15, 0.5})};
  double sigma[2] = {0, 0};
  for (const bool second : {false, true}) {
    BeamModel beam_model = nominal_beam;
    beam_model.divergence_rad = 0.002;
    beam_model.azimuth_sigma_rad = beam_model.elevation_sigma_rad = 5e-4;
    beam_model.second_returns = second;
    const LikelihoodTracking tracking(*model, beam_model, {});
    double nees = 0;
    constexpr int trials = 12;
    for (int i = 0; i < trials; ++i) {
      ScanMaker lidar(target.mesh, static_cast<std::uint64_t>(i + 1));
      lidar.beam = beam_model;
      lidar.footprint = true;
      lidar.pose = truth;
      Random random(static_cast<std::uint64_t>(i), "returns");
      const PreprocessedScan scan = preprocess(sweep_around(lidar, mesh, 3000), {}, beam_model);
      const auto result = tracking.track(scan, prediction_off(truth, 0.02, radians(1), random));
      REQUIRE(result.ok);
      const Vector6d error = difference(truth, result.pose);
      nees += error.dot(result.covariance.ldlt().solve(error)) / trials;
      sigma[second ? 1 : 0] += std::sqrt(result.covariance(0, 0)) / trials;
    }
    CAPTURE(second, nees, sigma[0], sigma[1]);
    CHECK(nees < 12);
    CHECK(nees > 1);
  }
  CHECK(sigma[1] < 0.95 * sigma[0]);
}
