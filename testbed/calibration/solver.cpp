// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/solver.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/error.h"
#include "common/core/statistics.h"
#include "testbed/calibration/measurements.h"

namespace berth::testbed {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Kinds of measurement, each with one scale on its sigmas.
enum Kind { scan_at_rest, scan_moving, point_at_rest, point_moving, kinds };
constexpr std::array<const char*, kinds> kind_names = {"scans", "scans in motion", "tracker",
                                                       "tracker in motion"};
constexpr double huber = 4.5;  // sigmas of a whole measurement, beyond which it counts less
constexpr int max_iterations = 150;
constexpr int rounds = 8;        // of raising sigmas
constexpr int tracker_size = 7;  // a pose and a time

/// Indices in the state vector: parameters, then each run's tracker, then the scans' bias.
struct Layout {
  Index trackers = calibration_size;
  Index bias = -1;
  Index size = calibration_size;
};

struct State {
  VectorXd values;
  std::vector<Pose> trackers;  // T_tracker_cell
  std::vector<double> tracker_times;
  Vector6d bias = Vector6d::Zero();
};

/// One measurement's place in the problem.
struct Term {
  Kind kind;
  std::size_t run;
  std::size_t index;
};

struct Row {
  VectorXd residual;  // whitened by the sigmas given
  MatrixXd jacobian;  // and its derivative by the state
};

struct Sums {
  MatrixXd information;
  VectorXd gradient;
  double cost = 0;
  std::array<MatrixXd, kinds> of_kind;
  std::array<double, kinds> chi2{};                // without scale, weighted
  std::array<double, kinds> count{};               // of numbers, weighted
  std::array<std::vector<double>, kinds> squares;  // of each measurement, over its number of axes
};

class Solver {
 public:
  explicit Solver(const CalibrationProblem& problem) : problem_(problem) {
    for (std::size_t r = 0; r < problem.runs.size(); ++r) {
      const CalibrationRun& run = problem.runs[r];
      for (std::size_t i = 0; i < run.scans.size(); ++i) {
        terms_.push_back({run.scans[i].moving ? scan_moving : scan_at_rest, r, i});
      }
      for (std::size_t i = 0; i < run.readings.size(); ++i) {
        terms_.push_back({run.readings[i].moving ? point_moving : point_at_rest, r, i});
      }
      with_tracker_ = with_tracker_ || !run.readings.empty();
    }
    state_.values = VectorXd::Zero(calibration_size);
    if (with_tracker_) {
      for (const CalibrationRun& run : problem.runs) {
        state_.trackers.push_back(place_tracker(problem.nominal, run));
        state_.tracker_times.push_back(0);
      }
      layout_.bias = layout_.trackers + tracker_size * static_cast<Index>(problem.runs.size());
      layout_.size = layout_.bias + 6;
    }
    prior_ = MatrixXd::Zero(layout_.size, layout_.size);
    prior_.topLeftCorner(calibration_size, calibration_size) =
        problem.prior.llt().solve(MatrixXd::Identity(calibration_size, calibration_size));
    for (std::size_t r = 0; r < state_.trackers.size(); ++r) {
      const Index at = layout_.trackers + tracker_size * static_cast<Index>(r) + 6;
      prior_(at, at) = 1 / (problem.tracker_time_sigma * problem.tracker_time_sigma);
    }
    if (layout_.bias >= 0) {
      constexpr double largest_m = 0.1;  // a sensor that is off by more than this is out of order
      constexpr double largest_rad = 0.1;
      prior_.diagonal().segment(layout_.bias, 3).setConstant(1 / (largest_m * largest_m));
      prior_.diagonal().segment(layout_.bias + 3, 3).setConstant(1 / (largest_rad * largest_rad));
    }
    scale_.fill(1);
  }

  CalibrationSolution solve() {
    CalibrationSolution solution;
    solution.before = residuals(state_);
    // A tracker's sigmas of micrometres, in a cell that is millimetres off, would make nearly all
    // measurements outliers at first, and convergence slow.
    raise_sigmas(add_up(state_, true));
    for (int round = 0; round < rounds; ++round) {
      solution.iterations += converge();
      if (!raise_sigmas(add_up(state_, true))) break;
    }
    solution.chi2_per_dof = chi2_at_rest(add_up(state_, true));
    finish(solution);
    return solution;
  }

 private:
  bool row_of(const Term& term, const Cell& cell, const State& state, Row& row) const {
    const CalibrationRun& run = problem_.runs[term.run];
    const bool scan = term.kind <= scan_moving;
    const double shift = scan ? state.values[lidar_time_index()] : state.tracker_times[term.run];
    const double time = (scan ? run.scans[term.index].time : run.readings[term.index].time) + shift;
    ArmPair joints;
    ArmPair rates;
    for (const ArmRole role : both_arms) {
      const auto at = run.arm(role).at(time - state.values[time_index(role)]);
      if (!at) return false;
      joints.of(role) = at->joints;
      rates.of(role) = at->rates;
    }
    if (scan) {
      scan_row(run.scans[term.index], cell, state, joints, rates, row);
    } else {
      point_row(term, cell, state, joints, rates, row);
    }
    return true;
  }

  void scan_row(const CalibrationRun::Scan& scan, const Cell& cell, const State& state,
                const ArmPair& joints, const ArmPair& rates, Row& row) const {
    const Pose predicted = perturbed(cell.relative_pose(joints.replica, joints.sensor), state.bias);
    const Matrix6d whiten = scan.covariance.llt().matrixL().solve(Matrix6d::Identity());
    row.residual = whiten * difference(predicted, scan.pose);
    row.jacobian = MatrixXd::Zero(6, layout_.size);
    row.jacobian.leftCols<calibration_size>() = -whiten * calibration_jacobian(cell, joints, rates);
    if (layout_.bias >= 0) row.jacobian.middleCols<6>(layout_.bias) = -whiten;
  }

  void point_row(const Term& term, const Cell& cell, const State& state, const ArmPair& joints,
                 const ArmPair& rates, Row& row) const {
    const CalibrationRun::Reading& reading = problem_.runs[term.run].readings[term.index];
    const Pose& tracker = state.trackers[term.run];
    const Joints& own = joints.of(reading.on);
    const Vector3d in_cell = cell.arm(reading.on).tool_pose(own) * reading.place;
    const Vector3d turned = tracker.rotation * in_cell;
    const PointJacobian jacobian =
        point_jacobian(cell, reading.on, own, rates.of(reading.on), reading.place);
    const Matrix3d turn = tracker.rotation.toRotationMatrix();
    row.residual = (reading.point - turned - tracker.position) / reading.sigma;
    row.jacobian = MatrixXd::Zero(3, layout_.size);
    row.jacobian.leftCols<calibration_size>() = -turn * jacobian / reading.sigma;
    const Index at = layout_.trackers + tracker_size * static_cast<Index>(term.run);
    row.jacobian.middleCols<3>(at) = -Matrix3d::Identity() / reading.sigma;
    row.jacobian.middleCols<3>(at + 3) = skew(turned) / reading.sigma;
    row.jacobian.col(at + 6) = turn * jacobian.col(time_index(reading.on)) / reading.sigma;
  }

  Sums add_up(const State& state, bool with_derivatives) const {
    const Cell cell = apply_calibration(problem_.nominal, state.values);
    Sums sums;
    sums.information = MatrixXd::Zero(layout_.size, layout_.size);
    sums.gradient = VectorXd::Zero(layout_.size);
    for (MatrixXd& of_kind : sums.of_kind) of_kind = sums.information;
    Row row;
    for (const Term& term : terms_) {
      if (!row_of(term, cell, state, row)) continue;
      const double size = static_cast<double>(row.residual.size());
      const double far = row.residual.norm() / scale_[term.kind];
      const double limit = huber * std::sqrt(size / 3);
      const double weight = far > limit ? limit / far : 1;
      sums.cost += far > limit ? 2 * limit * far - limit * limit : far * far;
      sums.chi2[term.kind] += weight * row.residual.squaredNorm();
      sums.count[term.kind] += weight * size;
      sums.squares[term.kind].push_back(row.residual.squaredNorm() / size);
      if (!with_derivatives) continue;
      const double of = weight / (scale_[term.kind] * scale_[term.kind]);
      sums.of_kind[term.kind].noalias() += of * row.jacobian.transpose() * row.jacobian;
      sums.gradient.noalias() += of * row.jacobian.transpose() * row.residual;
    }
    for (const MatrixXd& of_kind : sums.of_kind) sums.information += of_kind;
    const VectorXd away = departure(state);
    sums.cost += away.dot(prior_ * away);
    sums.gradient += prior_ * away;
    return sums;
  }

  /// Difference from the prior's mean.
  VectorXd departure(const State& state) const {
    VectorXd away = VectorXd::Zero(layout_.size);
    away.head<calibration_size>() = state.values;
    for (std::size_t r = 0; r < state.tracker_times.size(); ++r) {
      away[layout_.trackers + tracker_size * static_cast<Index>(r) + 6] = state.tracker_times[r];
    }
    if (layout_.bias >= 0) away.segment<6>(layout_.bias) = state.bias;
    return away;
  }

  State moved(const State& from, const VectorXd& step) const {
    State to = from;
    to.values += step.head<calibration_size>();
    for (std::size_t r = 0; r < to.trackers.size(); ++r) {
      const Index at = layout_.trackers + tracker_size * static_cast<Index>(r);
      to.trackers[r] = perturbed(to.trackers[r], step.segment<6>(at));
      to.trackers[r].rotation.normalize();
      to.tracker_times[r] += step[at + 6];
    }
    if (layout_.bias >= 0) to.bias += step.segment<6>(layout_.bias);
    return to;
  }

  /// @return iterations
  int converge() {
    // Change of chi2 at convergence. Later steps are along directions that only the prior
    // determines: with a tracker's small sigmas a narrow curved valley, in which descent is slow.
    constexpr double enough = 0.03;
    double damping = 1e-6;
    for (int i = 1; i <= max_iterations; ++i) {
      const Sums sums = add_up(state_, true);
      bool better = false;
      double promised = 0;
      while (!better && damping < 1e8) {
        MatrixXd damped = sums.information + prior_;
        damped.diagonal() *= 1 + damping;
        const VectorXd step = damped.ldlt().solve(-sums.gradient);
        promised = -sums.gradient.dot(step);
        const State next = moved(state_, step);
        if (add_up(next, false).cost <= sums.cost) {
          state_ = next;
          better = true;
          damping = std::max(1e-9, damping / 10);
        } else {
          damping *= 10;
        }
      }
      if (!better || promised < enough) return i;
    }
    throw InputError(
        "the calibration does not converge: are the cell's files and the run's the "
        "same, and the errors within the priors of calibration.yaml?");
  }

  MatrixXd covariance(const Sums& sums) const {
    return (sums.information + prior_).ldlt().solve(MatrixXd::Identity(layout_.size, layout_.size));
  }

  /// Degrees of freedom of a kind, less those of the parameters.
  static double freedom(const Sums& sums, const MatrixXd& covariance, int kind) {
    const auto k = static_cast<std::size_t>(kind);
    return std::max(1.0, sums.count[k] - (covariance * sums.of_kind[k]).trace());
  }

  double chi2_at_rest(const Sums& sums) const {
    const MatrixXd sigma = covariance(sums);
    double chi2 = 0;
    double left = 0;
    for (const int kind : {scan_at_rest, point_at_rest}) {
      if (sums.count[static_cast<std::size_t>(kind)] == 0) continue;
      chi2 += sums.chi2[static_cast<std::size_t>(kind)];
      left += freedom(sums, sigma, kind);
    }
    return left > 0 ? chi2 / left : 0;
  }

  /// By the median, which is robust against outliers.
  /// @return whether any changed by much
  bool raise_sigmas(const Sums& sums) {
    const MatrixXd sigma = covariance(sums);
    bool changed = false;
    for (int kind = 0; kind < kinds; ++kind) {
      const auto k = static_cast<std::size_t>(kind);
      if (sums.squares[k].empty()) continue;
      // of chi2 over its degrees of freedom: 6 of a pose, 3 of a point
      const double expected = kind <= scan_moving ? 0.891 : 0.789;
      const double taken = sums.count[k] / freedom(sums, sigma, kind);
      const double scale =
          std::max(1.0, std::sqrt(upper_median(sums.squares[k]) / expected * taken));
      changed = changed || std::abs(scale / scale_[k] - 1) > 0.02;
      scale_[k] = scale;
    }
    return changed;
  }

  void finish(CalibrationSolution& solution) const {
    const Sums sums = add_up(state_, true);
    const MatrixXd sigma = covariance(sums);
    solution.values = state_.values;
    solution.covariance = sigma.topLeftCorner(calibration_size, calibration_size);
    solution.with_tracker = with_tracker_;
    solution.information = sums.information.topLeftCorner(calibration_size, calibration_size);
    if (layout_.size > calibration_size) {
      // marginal information without the tracker's place and the scans' bias
      const Index rest = layout_.size - calibration_size;
      const MatrixXd cross = sums.information.topRightCorner(calibration_size, rest);
      const MatrixXd own = (sums.information + prior_).bottomRightCorner(rest, rest);
      solution.information -= cross * own.ldlt().solve(cross.transpose());
      solution.scan_bias = state_.bias;
      solution.scan_bias_covariance = sigma.block<6, 6>(layout_.bias, layout_.bias);
    }
    solution.after = residuals(state_);
    solution.residuals = summarised(solution.after);
  }

  std::vector<MeasurementResidual> residuals(const State& state) const {
    const Cell cell = apply_calibration(problem_.nominal, state.values);
    std::vector<MeasurementResidual> list;
    Row row;
    for (const Term& term : terms_) {
      if (!row_of(term, cell, state, row)) continue;
      const CalibrationRun& run = problem_.runs[term.run];
      const char* kind = kind_names[term.kind];
      if (term.kind <= scan_moving) {
        const CalibrationRun::Scan& scan = run.scans[term.index];
        const Vector6d off = scan.covariance.llt().matrixL() * row.residual;
        list.push_back({kind, scan.where, off.head<3>().norm(), off.tail<3>().norm()});
      } else {
        const CalibrationRun::Reading& reading = run.readings[term.index];
        list.push_back({kind, reading.where, reading.sigma * row.residual.norm(), {}});
      }
    }
    return list;
  }

  const CalibrationProblem& problem_;
  Layout layout_;
  State state_;
  MatrixXd prior_;
  std::vector<Term> terms_;
  std::array<double, kinds> scale_{};
  bool with_tracker_ = false;
};

}  // namespace

CalibrationSolution solve_calibration(const CalibrationProblem& problem) {
  std::size_t numbers = 0;
  for (const CalibrationRun& run : problem.runs) {
    for (const auto& scan : run.scans) numbers += scan.moving ? 0 : 6;
    for (const auto& reading : run.readings) numbers += reading.moving ? 0 : 3;
  }
  if (numbers < calibration_size) {
    throw InputError("found " + std::to_string(numbers) +
                     " numbers measured at rest, expected more than the " +
                     std::to_string(calibration_size) + " parameters: too few poses to calibrate");
  }
  if ((problem.prior.diagonal().array() <= 0).any()) {
    throw InputError("this layout has no real arms: there is nothing to calibrate");
  }
  return Solver(problem).solve();
}

}  // namespace berth::testbed
