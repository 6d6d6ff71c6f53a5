// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/reference_registration.h"

#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>

#include "common/core/error.h"
#include "test/benchmarks/table.h"

namespace berth::benchmark {
namespace {

struct ClosePipe {
  void operator()(std::FILE* pipe) const { pclose(pipe); }
};

void write_clouds(const estimator::TargetModel& model, const std::vector<TrackingTrial>& trials,
                  const std::filesystem::path& path) {
  std::ofstream out(path);
  out.precision(9);
  out << "model " << model.surface.samples.size() << '\n';
  for (const estimator::SurfaceSample& s : model.surface.samples) {
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

std::map<std::string, std::vector<TrackingOutcome>> reference_registrations(
    const estimator::TargetModel& model, const std::vector<TrackingTrial>& trials,
    const std::filesystem::path& directory) {
  const std::filesystem::path clouds = directory / "clouds.txt";
  write_clouds(model, trials, clouds);
  const auto program =
      std::filesystem::read_symlink("/proc/self/exe").parent_path() / "berth-benchmark-pcl";
  const std::string command = "'" + program.string() + "' '" + clouds.string() + "'";
  std::unique_ptr<std::FILE, ClosePipe> pipe(popen(command.c_str(), "r"));
  std::map<std::string, std::vector<TrackingOutcome>> outcomes;
  char line[1024];
  int lines = 0;
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
    progress("PCL", ++lines, static_cast<int>(2 * trials.size()));
  }
  std::filesystem::remove(clouds);
  for (const char* method : {"icp_with_normals", "gicp"}) {
    if (outcomes[method].size() != trials.size()) {
      throw InputError(program.string() + ": gave " + std::to_string(outcomes[method].size()) +
                       " results, expected " + std::to_string(trials.size()));
    }
  }
  return outcomes;
}

}  // namespace berth::benchmark
