// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/reference_registration.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>

#include "common/core/error.h"

namespace berth::benchmark {
namespace {

struct ClosePipe {
  void operator()(std::FILE* pipe) const { pclose(pipe); }
};

void write_clouds(const std::vector<SurfacePoint>& surface,
                  const std::vector<TrackingTrial>& trials, const std::filesystem::path& path) {
  std::ofstream out(path);
  out.precision(9);
  out << "model " << surface.size() << '\n';
  for (const SurfacePoint& s : surface) {
    out << s.position.transpose() << ' ' << s.normal.transpose() << '\n';
  }
  for (const TrackingTrial& trial : trials) {
    std::ostringstream points;
    points.precision(9);
    int count = 0;
    for (const RawBeam& beam : trial.scan.beams) {
      if (beam.status != BeamStatus::hit) continue;
      points << (beam.range * beam_direction(beam.azimuth, beam.elevation)).transpose() << '\n';
      ++count;
    }
    out << "cloud " << count << '\n'
        << trial.predicted.pose.inverse().isometry().matrix() << '\n'
        << points.str();
  }
  if (!out.flush()) throw InputError(path.string() + ": cannot be written");
}

}  // namespace

std::vector<SurfacePoint> points_on(const Mesh& mesh, int count, Random random) {
  std::vector<double> area_until;  // of all triangles up to this one
  double sum = 0;
  const auto corner = [&mesh](std::size_t triangle, std::size_t i) {
    return mesh.vertices[mesh.triangles[triangle][i]];
  };
  const auto across = [&corner](std::size_t t) -> Vector3d {
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area_until.push_back(sum += across(t).norm());
  }
  std::vector<SurfacePoint> points;
  for (int i = 0; i < count; ++i) {
    const auto at = std::upper_bound(area_until.begin(), area_until.end(), sum * random.uniform());
    const auto t =
        static_cast<std::size_t>(std::min(at, area_until.end() - 1) - area_until.begin());
    const double a = std::sqrt(random.uniform());
    const double b = random.uniform();
    points.push_back({(1 - a) * corner(t, 0) + a * (1 - b) * corner(t, 1) + a * b * corner(t, 2),
                      across(t).normalized()});
  }
  return points;
}

std::vector<SurfacePoint> points_of(const estimator::TargetModel& model) {
  std::vector<SurfacePoint> points;
  for (const estimator::SurfaceSample& s : model.surface.samples) {
    points.push_back({s.position.cast<double>(), s.normal.cast<double>()});
  }
  return points;
}

std::map<std::string, std::vector<TrackingOutcome>> reference_registrations(
    const std::vector<SurfacePoint>& surface, const std::vector<TrackingTrial>& trials,
    const std::filesystem::path& file, const ReferenceOptions& options) {
  write_clouds(surface, trials, file);
  const auto program =
      std::filesystem::read_symlink("/proc/self/exe").parent_path() / "berth-benchmark-pcl";
  std::string command = "'" + program.string() + "' '" + file.string() + "'";
  for (const double gate : options.gates) command += " " + std::to_string(gate);
  if (options.gicp) command += " gicp";
  std::unique_ptr<std::FILE, ClosePipe> pipe(popen(command.c_str(), "r"));
  std::map<std::string, std::vector<TrackingOutcome>> outcomes;
  char line[1024];
  while (pipe != nullptr && std::fgets(line, sizeof line, pipe.get()) != nullptr) {
    std::istringstream in(line);
    std::string method;
    TrackingOutcome outcome;
    in >> method >> outcome.cpu_ms;
    Eigen::Matrix4d matrix;
    for (int i = 0; i < 16; ++i) in >> matrix(i / 4, i % 4);
    auto& of_method = outcomes[method];
    if (!in || of_method.size() == trials.size()) break;
    const TrackingTrial& trial = trials[of_method.size()];
    const Pose found{matrix.topRightCorner<3, 1>(),
                     Quaterniond(Matrix3d(matrix.topLeftCorner<3, 3>())).normalized()};
    outcome.ok = true;
    outcome.error = difference(trial.truth, found.inverse());
    outcome.bound = trial.bound;
    outcome.returns = trial.scan.returns;
    of_method.push_back(outcome);
  }
  std::filesystem::remove(file);
  std::vector<std::string> methods = {"icp_with_normals"};
  if (options.gicp) methods.emplace_back("gicp");
  for (const std::string& method : methods) {
    if (outcomes[method].size() != trials.size()) {
      throw InputError(program.string() + ": gave " + std::to_string(outcomes[method].size()) +
                       " results, expected " + std::to_string(trials.size()));
    }
  }
  return outcomes;
}

}  // namespace berth::benchmark
