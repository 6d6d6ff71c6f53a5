// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/plan/information_planner.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace berth::estimator {

namespace {

/// Up to so many beams the design is compared with an even scan: the continuous approximation is
/// coarse.
constexpr int few_beams = 100;

/// Sigma points about a pose for an error of a point of the target of standard deviation sigma: the
/// corners of a simplex with its mean and covariance (half of the variance by translation, half by
/// rotation at the target's end).
std::vector<Pose> spread_about(const Pose& pose, double sigma, double half_length, bool mirrored) {
  constexpr int dimension = 6;
  std::vector<Pose> poses;
  for (int corner = 0; corner <= dimension; ++corner) {
    // Unit vectors with dot product -1/6 between any two.
    Vector6d d = Vector6d::Zero();
    for (int i = 0; i < std::min(corner + 1, dimension); ++i) {
      const double n = dimension - i;
      const double scale = std::sqrt((dimension + 1.0) / (dimension * n * (n + 1)));
      d[i] = i < corner ? -scale : n * scale;
    }
    d *= std::sqrt(double{dimension}) * sigma * std::sqrt(0.5);
    d.tail<3>() /= half_length;
    poses.push_back(perturbed(pose, d));
    if (mirrored) poses.push_back(perturbed(pose, -d));
  }
  return poses;
}

/// Moving mean of the columns over (2 * reach + 1) cells along one axis of a grid, truncated at its
/// ends.
void box_mean(Eigen::Matrix<double, 21, Eigen::Dynamic>& cells, int lines, int length,
              int line_step, int step, int reach) {
  Eigen::Matrix<double, 21, Eigen::Dynamic> line(21, length);
  for (int l = 0; l < lines; ++l) {
    for (int i = 0; i < length; ++i) line.col(i) = cells.col(l * line_step + i * step);
    PackedMatrix sum = PackedMatrix::Zero();
    for (int i = 0; i < std::min(reach, length); ++i) sum += line.col(i);
    for (int i = 0; i < length; ++i) {
      if (i + reach < length) sum += line.col(i + reach);
      if (i - reach > 0) sum -= line.col(i - reach - 1);
      const int count = std::min(i + reach, length - 1) - std::max(i - reach, 0) + 1;
      cells.col(l * line_step + i * step) = sum / count;
    }
  }
}

}  // namespace

/// Cells over the outline, row by row, with the information of a return in a window about each.
struct InformationPlanner::Grid {
  Window outline;
  int columns = 0;
  int rows = 0;
  double window_width = 0;
  double window_height = 0;
  Eigen::Matrix<double, 21, Eigen::Dynamic> information;
  Eigen::VectorXd correlation;  // see DesignProblem

  Eigen::Index cells() const { return Eigen::Index{columns} * rows; }
  Eigen::Index cell(int column, int row) const { return Eigen::Index{row} * columns + column; }
  double azimuth(int column) const {
    return outline.azimuth + ((column + 0.5) / columns - 0.5) * outline.width;
  }
  double elevation(int row) const {
    return outline.elevation - ((row + 0.5) / rows - 0.5) * outline.height;
  }
  /// About a cell, its size multiplied, moved into the outline.
  Window window(int cell, double size) const;
};

InformationPlanner::Grid InformationPlanner::cast(const PoseView& view, const Pose& pose,
                                                  double sigma, const Window& outline,
                                                  int beams) const {
  Grid grid;
  grid.outline = outline;
  const double cell = std::sqrt(outline.width * outline.height / options_.view_cells);
  grid.columns =
      std::clamp(static_cast<int>(std::lround(outline.width / cell)), 1, options_.view_cells);
  grid.rows =
      std::clamp(static_cast<int>(std::lround(outline.height / cell)), 1, options_.view_cells);
  grid.information.setZero(21, grid.cells());
  const double range = std::max((pose * model_.centre).norm(), field_.beam.range_min_m);
  std::vector<Vector3d> directions;
  directions.reserve(static_cast<std::size_t>(grid.cells()));
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      directions.push_back(beam_direction(grid.azimuth(column), grid.elevation(row)));
    }
  }
  std::vector<BeamReturn> returns(directions.size());
  view.returns(directions, returns);
  // Windows as large as the prediction is uncertain; no smaller than a beam, or than lets the LIDAR
  // put all of the beams side by side.
  const double min_step = 1.001 * field_.minimum_step;
  const double half = std::min(
      0.5,
      std::max({options_.margin_sigmas * sigma / range, 0.5 * field_.beam.footprint(range) / range,
                0.5 * min_step * std::sqrt(static_cast<double>(beams))}));
  grid.window_width = std::min(2 * half, outline.width);
  grid.window_height = std::min(2 * half, outline.height);
  grid.correlation.setZero(grid.cells());
  const double area = view.area(grid.window_width, grid.window_height);
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const auto cell_index = static_cast<Eigen::Index>(i);
    grid.information.col(cell_index) = packed_square(returns[i].root);
    grid.correlation[cell_index] = returns[i].correlation_within(area);
  }
  // Edges, by the information of beams spread over their cell.
  const double cell_area = view.area(outline) / static_cast<double>(grid.cells());
  view.edges_in(outline, [&](std::size_t i) {
    const auto [azimuth, elevation] = view.edge_angles(i);
    const auto at = [](double share, int count) {
      return std::clamp(static_cast<int>(share * count), 0, count - 1);
    };
    const Eigen::Index in =
        grid.cell(at(0.5 + (azimuth - outline.azimuth) / outline.width, grid.columns),
                  at(0.5 - (elevation - outline.elevation) / outline.height, grid.rows));
    const EdgePiece& edge = view.edges()[i];
    grid.information.col(in) += packed_square(edge.root) / cell_area;
    grid.correlation[in] = std::max(grid.correlation[in], edge.correlation / area);
  });
  const double reach = half + sigma / range;
  const auto cells = [&](double side, int count) {
    return std::clamp(static_cast<int>(std::lround(reach * count / side - 0.5)), 0, count);
  };
  box_mean(grid.information, grid.rows, grid.columns, grid.columns, 1,
           cells(outline.width, grid.columns));
  box_mean(grid.information, grid.columns, grid.rows, 1, grid.columns,
           cells(outline.height, grid.rows));
  return grid;
}

Window InformationPlanner::Grid::window(int cell, double size) const {
  const double width = std::min(size * window_width, outline.width);
  const double height = std::min(size * window_height, outline.height);
  const auto moved_in = [](double place, double centre, double slack) {
    return std::clamp(place, centre - 0.5 * slack, centre + 0.5 * slack);
  };
  return {moved_in(azimuth(cell % columns), outline.azimuth, outline.width - width),
          moved_in(elevation(cell / columns), outline.elevation, outline.height - height),
          width,
          height,
          Pattern::raster,
          0,
          0,
          "information"};
}

std::vector<Window> InformationPlanner::candidates(const Grid& grid, const Matrix6d& prior,
                                                   int beams, InformationPlan& plan) const {
  DesignProblem problem;
  problem.prior = prior;
  problem.returns = beams;
  problem.information = {grid.information};
  problem.correlation = grid.correlation;
  Design design = a_optimal_design(problem, options_.max_windows, options_.design_tolerance);
  plan.min_rms = std::sqrt(std::max(0.0, design.min_trace));
  std::vector<int> cells = design.candidates;
  if (cells.empty()) return {};
  // Besides the design's windows, the best elsewhere: the visibility of thin parts is uncertain.
  std::vector<bool> taken(static_cast<std::size_t>(grid.cells()));
  const auto take = [&](int cell) {
    const int x = cell % grid.columns;
    const int y = cell / grid.columns;
    const int wide = 1 + static_cast<int>(grid.window_width * grid.columns / grid.outline.width);
    const int high = 1 + static_cast<int>(grid.window_height * grid.rows / grid.outline.height);
    for (int v = std::max(0, y - high); v <= std::min(grid.rows - 1, y + high); ++v) {
      for (int u = std::max(0, x - wide); u <= std::min(grid.columns - 1, x + wide); ++u) {
        taken[static_cast<std::size_t>(grid.cell(u, v))] = true;
      }
    }
  };
  for (const int cell : cells) take(cell);
  while (static_cast<int>(cells.size()) < options_.max_windows) {
    int best = -1;
    for (int i = 0; i < grid.cells(); ++i) {
      if (taken[static_cast<std::size_t>(i)] || !(design.sensitivity[i] > 0)) continue;
      if (best < 0 || design.sensitivity[i] > design.sensitivity[best]) best = i;
    }
    if (best < 0) break;
    cells.push_back(best);
    take(best);
  }
  std::vector<Window> windows;
  for (const double size : {0.5, 1.0, 2.0}) {
    for (const int cell : cells) windows.push_back(grid.window(cell, size));
  }
  windows.push_back(grid.outline);
  windows.back().name = "information";
  return windows;
}

DesignProblem InformationPlanner::evaluate_windows(const PoseView& view, const Pose& pose,
                                                   double sigma, const std::vector<Window>& windows,
                                                   const Matrix6d& prior, int beams) const {
  constexpr int beams_each = 9;
  std::vector<Vector3d> directions;
  directions.reserve(windows.size() * beams_each);
  for (Window window : windows) {
    window.count = beams_each;
    append_raster(window, directions);
  }
  std::vector<BeamReturn> returns(directions.size());
  DesignProblem problem;
  problem.prior = prior;
  problem.returns = beams;
  problem.correlation.setZero(static_cast<Eigen::Index>(windows.size()));
  const std::vector<Pose> poses =
      spread_about(pose, sigma, model_.canonical.half_length, beams <= few_beams);
  for (const Pose& p : poses) {
    const PoseView there = view.moved_to(p);
    there.returns(directions, returns);
    auto& information = problem.information.emplace_back(21, windows.size());
    information.setZero();
    for (std::size_t i = 0; i < returns.size(); ++i) {
      const BeamReturn& beam = returns[i];
      if (beam.root.isZero(0)) continue;
      const auto window = static_cast<Eigen::Index>(i / beams_each);
      information.col(window) += packed_square(beam.root) / beams_each;
      problem.correlation[window] += beam.correlation_within(view.area(windows[i / beams_each])) /
                                     (beams_each * static_cast<double>(poses.size()));
    }
    for (std::size_t w = 0; w < windows.size(); ++w) {
      const auto window = static_cast<Eigen::Index>(w);
      const double area = there.area(windows[w]);
      there.edges_in(windows[w], [&](std::size_t i) {
        information.col(window) += packed_square(there.edges()[i].root) / area;
      });
    }
  }
  return problem;
}

double InformationPlanner::expected_trace(const PoseView& view, const Pose& pose, double sigma,
                                          const std::vector<Window>& windows,
                                          const Matrix6d& prior) const {
  const std::vector<Pose> poses = spread_about(pose, sigma, model_.canonical.half_length, true);
  double sum = 0;
  for (const Pose& p : poses) {
    const Matrix6d information = prior + scan_information(view.moved_to(p), windows);
    sum += information.llt().solve(Matrix6d::Identity()).trace();
  }
  return sum / static_cast<double>(poses.size());
}

Matrix6d InformationPlanner::prior_information(const PoseView& view,
                                               const std::vector<Window>& others) const {
  // A weak prior for unobservable directions.
  const double known = 0.3 * model_.canonical.half_length;
  return Matrix6d::Identity() / (known * known) + scan_information(view, others);
}

double InformationPlanner::spread(double predicted_sigma) const {
  // Windows must contain the target anywhere within the margin for a tracker to recover.
  return std::hypot(predicted_sigma, options_.min_margin_m / options_.margin_sigmas);
}

std::vector<int> InformationPlanner::share(const Pose& pose, double predicted_sigma,
                                           const std::vector<Window>& windows, int beams,
                                           const std::vector<Window>& others) const {
  const PoseView view(model_, &scene_, field_.beam, options_, pose);
  const DesignProblem problem = evaluate_windows(view, pose, spread(predicted_sigma), windows,
                                                 prior_information(view, others), beams);
  const Design design =
      a_optimal_design(problem, static_cast<int>(windows.size()), options_.design_tolerance);
  std::vector<int> counts(windows.size(), 0);
  const std::vector<int> shares = apportioned(design.shares, beams);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    counts[static_cast<std::size_t>(design.candidates[i])] = shares[i];
  }
  return counts;
}

InformationPlan InformationPlanner::plan(const Pose& pose, double predicted_sigma,
                                         const Window& outline, int beams,
                                         const std::vector<Window>& others) const {
  InformationPlan plan;
  if (beams < 1 || !(outline.width > 0 && outline.height > 0)) return plan;
  const double sigma = spread(predicted_sigma);
  const PoseView view(model_, &scene_, field_.beam, options_, pose);
  const Matrix6d prior = prior_information(view, others);
  const std::vector<Window> windows =
      candidates(cast(view, pose, sigma, outline, beams), prior, beams, plan);
  if (windows.empty()) return plan;
  // A window of one or two beams is not robust.
  const int max_windows = std::clamp(beams / 4, 6, std::max(6, options_.max_windows));
  const Design design = a_optimal_design(evaluate_windows(view, pose, sigma, windows, prior, beams),
                                         max_windows, options_.design_tolerance);
  plan.rms_bound = std::sqrt(design.trace);
  const std::vector<int> counts = apportioned(design.shares, beams);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    plan.windows.push_back(windows[static_cast<std::size_t>(design.candidates[i])]);
    plan.windows.back().count = counts[i];
  }
  if (beams > few_beams) return plan;
  Window everywhere = windows.back();
  everywhere.count = beams;
  const double chosen = expected_trace(view, pose, sigma, plan.windows, prior);
  const double uniform = expected_trace(view, pose, sigma, {everywhere}, prior);
  if (uniform < chosen) plan.windows = {everywhere};
  plan.rms_bound = std::sqrt(std::min(uniform, chosen));
  return plan;
}

}  // namespace berth::estimator
