// SPDX-License-Identifier: BSD-3-Clause
// The method of docs/estimator.md once more, from that page alone: dense, slow, of one convex body.
// Every beam errs by offsets of its own, with their whole covariance; Jacobians are numeric.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "estimator/track/likelihood_tracking.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

using Vector7d = Eigen::Matrix<double, 7, 1>;  // pose, offset of the edges
using Matrix7d = Eigen::Matrix<double, 7, 7>;

struct Surface {
  double sigma = 0;   // m
  double length = 1;  // m
};

class ScanReference {
 public:
  ScanReference(const Mesh& mesh, const BeamModel& beam, const PreprocessedScan& scan,
                const Prediction& prior, const Surface& surface)
      : beam_(beam), scan_(scan), prior_(prior), surface_(surface) {
    for (const auto& t : mesh.triangles) {
      faces_.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
    }
    for (const Vector3d& v : mesh.vertices) centre_ += v / double(mesh.vertices.size());
    for (const Vector3d& v : mesh.vertices) {
      depth_ = std::max(depth_, 2 * (v - centre_).norm());
    }
  }

  /// The most probable state by Gauss-Newton, offsets marginalised; and its covariance.
  Vector7d solve(Matrix7d& covariance) {
    Vector7d x = Vector7d::Zero();
    by_.assign(scan_.beams.size(), 0);
    out_.assign(scan_.beams.size(), 0);
    for (int i = 0; i < 30; ++i) {
      const std::vector<Met> met = look(x);
      learn(met, x);
      const std::vector<Row> rows = observations(met, x);
      const auto n = static_cast<Eigen::Index>(rows.size());
      Eigen::MatrixXd j(n, 7), k(n, n);
      Eigen::VectorXd r(n), noise(n);
      for (Eigen::Index a = 0; a < n; ++a) {
        const Row& row = rows[static_cast<std::size_t>(a)];
        j.row(a) = row.jacobian;
        r[a] = row.residual;
        noise[a] = 1 / row.weight;
        for (Eigen::Index b = 0; b <= a; ++b) {
          k(a, b) = k(b, a) = alike(row, rows[static_cast<std::size_t>(b)]);
        }
      }
      const Eigen::LLT<Eigen::MatrixXd> all(k + Eigen::MatrixXd(noise.asDiagonal()));
      Matrix7d before = Matrix7d::Zero();
      before.topLeftCorner<6, 6>() = prior_.covariance.inverse();
      before(6, 6) = std::pow(0.25 * beam_.footprint(prior_.pose.position.norm()), -2);
      covariance = (j.transpose() * all.solve(j) + before).inverse();
      const Vector7d step = covariance * (j.transpose() * all.solve(r) - before * x);
      const Eigen::VectorXd delta = k * all.solve(r - j * step);
      by_.assign(scan_.beams.size(), 0);
      out_.assign(scan_.beams.size(), 0);
      for (Eigen::Index a = 0; a < n; ++a) {
        const Row& row = rows[static_cast<std::size_t>(a)];
        (row.edge ? out_ : by_)[row.beam] = delta[a];
      }
      x += step;
      if (step.norm() < 1e-7) break;
    }
    return x;
  }

 private:
  /// What one beam may meet, and of which offsets.
  struct Met {
    const Beam* beam = nullptr;
    std::size_t index = 0;
    double range = 0, mixed = 0, cosine = 1;
    Vector3d place, normal;
    bool edge = false;
    double inside = 0;  // m, from the edge
    Vector3d edge_place, edge_along, outward;
  };
  /// residual = jacobian d + offset + noise of variance 1 / weight.
  struct Row {
    std::size_t beam;
    bool edge;
    double weight, residual;
    Eigen::Matrix<double, 1, 7> jacobian;
    Vector3d place, moved;  // where, and how a displacement of the surface changes it
  };

  struct Cast {
    double range = std::numeric_limits<double>::infinity();
    Vector3d normal = Vector3d::Zero();
  };
  Vector3d outer_normal(const std::array<Vector3d, 3>& t) const {
    const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    return n.dot(t[0] - centre_) > 0 ? n : Vector3d(-n);
  }
  Cast cast(const Vector3d& eye, const Vector3d& direction) const {
    Cast nearest;
    for (const auto& t : faces_) {
      Matrix3d m;
      m << direction, t[0] - t[1], t[0] - t[2];
      if (std::abs(m.determinant()) < 1e-12) continue;
      const Vector3d s = m.inverse() * (t[0] - eye);
      if (s[0] > 0 && s[1] >= 0 && s[2] >= 0 && s[1] + s[2] <= 1 && s[0] < nearest.range) {
        nearest = {s[0], outer_normal(t)};
      }
    }
    return nearest;
  }

  /// Edges of which all triangles lie on one side of the plane through them and the eye.
  struct Edge {
    Vector3d a, b, front;  // normal of the face before it
  };
  std::vector<Edge> edges_from(const Vector3d& eye) const {
    std::vector<Edge> edges;
    for (const auto& t : faces_) {
      if (outer_normal(t).dot(t[0] - eye) >= 0) continue;  // turned away
      for (std::size_t i = 0; i < 3; ++i) {
        const Vector3d& a = t[i];
        const Vector3d& b = t[(i + 1) % 3];
        const Vector3d across = (a - eye).cross(b - eye).normalized();
        bool positive = false, negative = false;
        for (const auto& other : faces_) {
          int at = 0;
          double off = 0;
          for (const Vector3d& v : other) {
            if ((v - a).norm() < 1e-9 || (v - b).norm() < 1e-9) {
              ++at;
            } else {
              off = across.dot(v - eye);
            }
          }
          if (at == 2) (off > 0 ? positive : negative) = true;
        }
        if (positive != negative) edges.push_back({a, b, outer_normal(t)});
      }
    }
    return edges;
  }

  Pose pose_at(const Vector7d& x) const { return perturbed(prior_.pose, Vector6d(x.head<6>())); }
  double width(double range) const {
    return std::hypot(0.25 * beam_.footprint(range), range * std::sqrt(beam_.angle_variance()));
  }

  std::vector<Met> look(const Vector7d& x) const {
    const Pose model = pose_at(x).inverse();
    const Vector3d eye = model.position;
    const std::vector<Edge> edges = edges_from(eye);
    std::vector<Met> all;
    for (const Beam& beam : scan_.beams) {
      Met met;
      met.beam = &beam;
      met.index = static_cast<std::size_t>(&beam - scan_.beams.data());
      const Vector3d direction = model.rotation * beam.direction;
      const Cast hit = cast(eye, direction);
      double nearest = 3 * std::hypot(width(eye.norm()), surface_.sigma);
      const Edge* front = nullptr;
      for (const Edge& e : edges) {
        // Where the edge comes nearest to the beam.
        const Vector3d along = e.b - e.a;
        const Vector3d off = along - along.dot(direction) * direction;
        const Vector3d from = (eye - e.a) - (eye - e.a).dot(direction) * direction;
        const double s = std::clamp(off.dot(from) / off.squaredNorm(), 0.0, 1.0);
        const Vector3d place = e.a + s * along;
        const Vector3d apart = place - eye - (place - eye).dot(direction) * direction;
        if (apart.norm() > nearest) continue;
        nearest = apart.norm();
        front = &e;
        met.edge = true;
        met.edge_place = place;
        met.edge_along = along;
        const Vector3d sight = (place - eye).normalized();
        Vector3d outward = along.cross(sight).normalized();
        if (outward.dot(place - centre_) < 0) outward = -outward;
        met.outward = outward;
        met.inside = std::isfinite(hit.range) ? nearest : -nearest;
      }
      if (!std::isfinite(hit.range) && !met.edge) continue;
      met.normal = std::isfinite(hit.range) ? hit.normal : front->front;
      met.range = std::isfinite(hit.range)
                      ? hit.range
                      : met.normal.dot(front->a - eye) / met.normal.dot(direction);
      if (!std::isfinite(hit.range)) {
        const double at = (met.edge_place - eye).dot(direction);
        if (-met.normal.dot(direction) < std::sqrt(0.5)) {
          met.range = at;
          met.normal = -direction;
        }
      }
      met.cosine = std::max(0.03, -met.normal.dot(direction));
      met.place = eye + met.range * direction;
      // The footprint: six rays about the axis.
      const Vector3d side = direction.unitOrthogonal();
      const double aside = 0.35 * beam_.footprint(met.range) / met.range;
      double sum = 0;
      int count = std::isfinite(hit.range) ? 1 : 0;
      for (int k = 0; k < 6; ++k) {
        const Vector3d to = Eigen::AngleAxisd(radians(60.0 * k), direction) * side;
        const Cast one = cast(eye, (direction + aside * to).normalized());
        if (!std::isfinite(one.range)) continue;
        sum += one.range - met.range;
        ++count;
      }
      if (count > 0) met.mixed = sum / count;
      all.push_back(met);
    }
    return all;
  }

  double variance(const Met& m) const {
    const double c2 = m.cosine * m.cosine;
    const double bend = surface_.sigma * surface_.sigma / (surface_.length * c2);
    return std::pow(beam_.range_sigma_m, 2) +
           beam_.angle_variance() * m.range * m.range * (1 - c2) / c2 + bend * bend +
           m.mixed * m.mixed;
  }

  /// log L of a beam with its face `by` farther and its edge `out` farther out.
  double log_likelihood(const Met& m, double by, double out, double* from_face = nullptr) const {
    double c = 1;
    if (m.edge) c = 0.5 * std::erfc(-(m.inside + out) / width(m.range) / std::sqrt(2.0));
    const double dropped = drop_out_[static_cast<std::size_t>(std::min(3.0, 4 * m.cosine))];
    if (!m.beam->hit()) {
      return std::log(c * dropped + (1 - c) * (1 - outlier_) * (1 - background_));
    }
    const double v = variance(m);
    const double e = m.beam->range - m.range - m.mixed - by;
    const double normal = std::exp(-0.5 * e * e / v) / std::sqrt(2 * M_PI * v);
    const double face = c * (1 - dropped - outlier_) * normal;
    const double sum =
        face + outlier_ / depth_ + (1 - c) * (1 - outlier_) * background_ / (2 * depth_);
    if (from_face != nullptr) *from_face = face / sum;
    return std::log(sum);
  }

  std::vector<Row> observations(const std::vector<Met>& all, const Vector7d& x) const {
    std::vector<Row> rows;
    for (const Met& m : all) {
      const double by = by_[m.index];
      const double out = x[6] + out_[m.index];
      // Where this face and this edge are, of a state moved by so much.
      const auto range_at = [&](const Vector7d& y) {
        const Pose model = pose_at(y).inverse();
        const Vector3d direction = model.rotation * m.beam->direction;
        return m.normal.dot(m.place - model.position) / m.normal.dot(direction);
      };
      const auto inside_at = [&](const Vector7d& y) {
        const Pose model = pose_at(y).inverse();
        const Vector3d direction = model.rotation * m.beam->direction;
        Vector3d across = direction.cross(m.edge_along).normalized();
        if (across.dot(m.outward) < 0) across = -across;
        return across.dot(m.edge_place - model.position) + y[6];
      };
      const auto jacobian = [&x](const auto& value) {
        Eigen::Matrix<double, 1, 7> j;
        constexpr double h = 1e-6;
        for (int i = 0; i < 7; ++i) {
          const Vector7d step = h * Vector7d::Unit(i);
          j[i] = (value(x + step) - value(x - step)) / (2 * h);
        }
        return j;
      };
      double from_face = 0;
      const double here = std::exp(log_likelihood(m, by, out, &from_face));
      if (m.beam->hit() && from_face > 1e-4) {
        rows.push_back({m.index, false, from_face / variance(m), m.beam->range - m.range - m.mixed,
                        jacobian(range_at), m.place, -m.normal / m.cosine});
      }
      if (!m.edge) continue;
      // The likelihood is c A + (1 - c) G: A and G where c is 1 and 0.
      const double a = std::exp(log_likelihood(m, by, 1));
      const double g = std::exp(log_likelihood(m, by, -1));
      const double w = width(m.range);
      const double u = (m.inside + out) / w;
      const double slope = std::exp(-0.5 * u * u) / std::sqrt(2 * M_PI) / w;
      const double c = 0.5 * std::erfc(-u / std::sqrt(2.0));
      if (!(c * (1 - c) > 1e-9)) continue;
      const double score = slope * (a - g) / here;
      const double weight = std::max(score * (score + u / w), 1e-6 / (w * w));
      rows.push_back({m.index, true, weight, score / weight + out_[m.index], jacobian(inside_at),
                      m.edge_place, m.outward});
    }
    return rows;
  }

  double alike(const Row& a, const Row& b) const {
    const double near =
        std::exp(-(a.place - b.place).squaredNorm() / (2 * surface_.length * surface_.length));
    const double sight = a.edge || b.edge ? 0 : 1;
    return surface_.sigma * surface_.sigma * near * (a.moved.dot(b.moved) + sight);
  }

  /// Shares by one step of expectation maximisation, with what is usual worth 20 beams.
  void learn(const std::vector<Met>& all, const Vector7d& x) {
    double stray = 0, returned = 0, passed = 0, passed_returned = 0;
    std::array<double, 4> met_beams{}, missed{};
    for (const Met& m : all) {
      const double out = x[6] + out_[m.index];
      double c = 1;
      if (m.edge) c = 0.5 * std::erfc(-(m.inside + out) / width(m.range) / std::sqrt(2.0));
      const auto bin = static_cast<std::size_t>(std::min(3.0, 4 * m.cosine));
      const double behind = (1 - c) * (1 - outlier_);
      if (m.beam->hit()) {
        double face = 0;
        const double sum = std::exp(log_likelihood(m, by_[m.index], out, &face));
        stray += outlier_ / depth_ / sum;
        returned += 1;
        met_beams[bin] += face;
        passed += behind * background_ / (2 * depth_) / sum;
        passed_returned += behind * background_ / (2 * depth_) / sum;
      } else {
        const double sum = c * drop_out_[bin] + behind * (1 - background_);
        missed[bin] += c * drop_out_[bin] / sum;
        met_beams[bin] += c * drop_out_[bin] / sum;
        passed += behind * (1 - background_) / sum;
      }
    }
    outlier_ = (stray + worth * usual_outlier) / (returned + worth);
    background_ = (passed_returned + worth * usual_background) / (passed + worth);
    for (std::size_t b = 0; b < 4; ++b) {
      drop_out_[b] = (missed[b] + worth * usual_drop_out[b]) / (met_beams[b] + worth);
    }
  }

  BeamModel beam_;
  const PreprocessedScan& scan_;
  Prediction prior_;
  Surface surface_;
  std::vector<std::array<Vector3d, 3>> faces_;
  Vector3d centre_ = Vector3d::Zero();
  double depth_ = 0;
  std::vector<double> by_, out_;  // most probable offsets of each beam's face and edge, m
  // Usual shares, and what they are worth in beams.
  static constexpr double usual_outlier = 0.02, usual_background = 0.5, worth = 20;
  static constexpr std::array<double, 4> usual_drop_out = {0.1, 0.05, 0.03, 0.03};
  double outlier_ = usual_outlier;
  double background_ = usual_background;
  std::array<double, 4> drop_out_ = usual_drop_out;
};

}  // namespace

TEST_CASE("A slow reference, written from the documentation, finds the same pose") {
  const double soft = GENERATE(1e-6, 0.008);
  const int seed = GENERATE(1, 2);
  CAPTURE(soft, seed);
  Target target = described(make_box({1.4, 0.9, 0.6}));
  target.parts.front().surface_sigma = soft;
  target.parts.front().correlation_length = 0.3;
  const Pose truth{{0.1, -0.05, 4.5}, rotation_from_vector({0.4, 0.5, 0.1 * seed})};
  ScanMaker lidar(target.mesh, static_cast<std::uint64_t>(seed));
  lidar.pose = truth;
  PreprocessedScan scan = preprocess(sweep_around(lidar, target.mesh, 260), {}, nominal_beam);
  // The surface off along the line of sight by a smooth function of the place.
  for (Beam& beam : scan.beams) {
    if (!beam.hit()) continue;
    const Vector3d place = truth.inverse() * beam.point();
    beam.range += soft * (std::sin(5 * place.x() + seed) + std::cos(4 * place.y()));
  }
  Prediction predicted;
  Vector6d off;
  off << 0.004, -0.003, 0.005, 0.002, -0.002, 0.003;
  predicted.pose = perturbed(truth, off);
  predicted.covariance = Matrix6d::Zero();
  predicted.covariance.diagonal().head<3>().setConstant(1e-4);
  predicted.covariance.diagonal().tail<3>().setConstant(1e-4);

  const auto model = coarse_model(target);
  LikelihoodTrackingOptions options;
  options.described_surface_factor = 1.001;  // scales as described: the reference learns none
  const LikelihoodTracking method(*model, nominal_beam, options);
  const TrackingResult found = method.track(scan, predicted);
  INFO(found.reason);
  REQUIRE(found.ok);

  ScanReference reference(target.mesh, nominal_beam, scan, predicted, {soft, 0.3});
  Matrix7d covariance;
  const Vector7d x = reference.solve(covariance);
  const Pose pose = perturbed(predicted.pose, Vector6d(x.head<6>()));
  const Vector6d apart = difference(pose, found.pose);
  const Matrix6d expected = covariance.topLeftCorner<6, 6>();
  CAPTURE(apart.transpose(), expected.diagonal().cwiseSqrt().transpose(),
          found.covariance.diagonal().cwiseSqrt().transpose());
  // In any direction a third of a standard deviation, and sigmas within a quarter.
  CHECK(std::sqrt(apart.dot(expected.ldlt().solve(apart))) < 1.0 / 3);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> ratios(found.covariance, expected);
  CHECK(std::sqrt(ratios.eigenvalues().minCoeff()) > 0.75);
  CHECK(std::sqrt(ratios.eigenvalues().maxCoeff()) < 1.25);
}
