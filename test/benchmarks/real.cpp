// SPDX-License-Identifier: BSD-3-Clause
// Real scans against measured truth and published figures: the sets of BERTH_REAL_DATA.
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/clouds/cloud.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/lidar_profile.h"
#include "estimator/single_scan.h"
#include "test/benchmarks/judge.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

namespace fs = std::filesystem;
using estimator::AcquisitionResult;
using estimator::SingleScanResult;

/// One scan of a target whose pose was measured.
struct RealScan {
  std::string set;
  std::string name;
  fs::path cloud;
  fs::path mesh;
  double length = 0;         ///< m; 0: the mesh's own
  bool backward = false;     ///< the cloud has y up and z backward
  std::vector<Pose> truths;  ///< T_sensor_model; several where the target is symmetric
  Matrix6d truth_covariance = Matrix6d::Zero();
  double tolerance_m = 0;
  double tolerance_rad = 0;
  std::optional<BeamModel> scanner;   ///< for tracking, where its maker describes it
  double published_m = std::nan("");  ///< error of the published method's own estimate
  double published_rad = std::nan("");

  /// The set, and the part of it that the scan is of.
  std::vector<std::string> groups() const {
    const auto part = name.find_last_of('_');
    if (part == std::string::npos) return {set};
    return {set, set + " " + name.substr(0, part)};
  }
};

Pose pose_of(const nlohmann::json& rows) {
  Eigen::Matrix4d m;
  for (std::size_t r = 0; r < 4; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      m(static_cast<int>(r), static_cast<int>(c)) = rows.at(r).at(c).get<double>();
    }
  }
  const Matrix3d rotation = m.topLeftCorner<3, 3>();
  return {m.topRightCorner<3, 1>(), Quaterniond(rotation).normalized()};
}

nlohmann::json json_of(const fs::path& file) {
  try {
    return nlohmann::json::parse(read_file(file));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file.string() + ": " + e.what());
  }
}

std::vector<fs::path> files_of(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// A flat board seen by a spinning LIDAR; motion capture measures its pose to some 30 mm along its
/// normal, the model's x.
void add_umich(const fs::path& folder, std::vector<RealScan>& scans) {
  for (const fs::path& file : files_of(folder, ".json")) {
    const nlohmann::json json = json_of(file);
    RealScan scan;
    scan.set = "umich";
    scan.name = file.stem();
    scan.cloud = fs::path(file).replace_extension(".xyz");
    scan.mesh = folder / "target.stl";
    scan.length = 1.0871;
    scan.truths = {pose_of(json.at("T_sensor_model_mocap"))};
    const Vector3d normal = scan.truths.front().rotation * Vector3d::UnitX();
    scan.truth_covariance.topLeftCorner<3, 3>() = std::pow(0.030, 2) * normal * normal.transpose();
    // Velodyne VLP-32C: ranges good to 3 cm, beams of 3 mrad that leave it 12 mm wide.
    scan.scanner.emplace();
    scan.scanner->range_bias_m = 0.03;
    scan.scanner->divergence_rad = 3e-3;
    scan.tolerance_m = 0.080;
    scan.tolerance_rad = radians(7);
    const Pose published = pose_of(json.at("T_sensor_model_published_estimate"));
    scan.published_m = distance(scan.truths.front(), published);
    scan.published_rad = angle_between(scan.truths.front(), published);
    scans.push_back(std::move(scan));
  }
}

/// Printed parts seen by a depth camera; truth is good to a few mm and degrees: 3 of both, 1 sigma.
void add_realsense(const fs::path& folder, std::vector<RealScan>& scans) {
  if (!fs::exists(folder / "truth.json")) return;
  const Pose about{Vector3d::Zero(), Quaterniond(0, 1, 0, 0)};  // y up, z backward: half a turn
  const nlohmann::json all = json_of(folder / "truth.json");
  for (const auto& [name, json] : all.items()) {
    RealScan scan;
    scan.set = "realsense";
    scan.name = name;
    scan.cloud = folder / (name + ".ply");
    scan.mesh = folder / json.at("mesh").get<std::string>();
    scan.backward = true;
    for (const auto& rows : json.at("T_sensor_model_equivalent")) {
      scan.truths.push_back(about * pose_of(rows));
    }
    scan.truth_covariance.diagonal().head<3>().setConstant(std::pow(0.003, 2));
    scan.truth_covariance.diagonal().tail<3>().setConstant(std::pow(radians(3), 2));
    scan.tolerance_m = 0.008;
    scan.tolerance_rad = radians(5);
    scans.push_back(std::move(scan));
  }
}

std::vector<RawBeam> beams_of(const RealScan& scan) {
  std::vector<RawBeam> beams;
  for (const clouds::CloudBeam& beam : clouds::read_cloud(scan.cloud).beams) {
    RawBeam raw{beam.utime,
                beam.range,
                beam.azimuth,
                beam.elevation,
                beam.hit ? BeamStatus::hit : BeamStatus::miss,
                beam.range_sigma};
    if (scan.backward) {
      const Vector3d d = beam_direction(raw.azimuth, raw.elevation);
      beam_angles({d.x(), -d.y(), -d.z()}, raw.azimuth, raw.elevation);
    }
    beams.push_back(raw);
  }
  return beams;
}

/// A mesh as the estimator holds it, shared by its scans.
struct Model {
  std::shared_ptr<const estimator::TargetModel> model;
  double scale = 1;
};
using Models = std::map<std::string, Model>;

Models models_of(const Settings& settings, const std::vector<RealScan>& scans) {
  Models models;
  for (const RealScan& scan : scans) {
    Model& model = models[scan.mesh.string()];
    if (model.model != nullptr) continue;
    const std::string mesh = scan.mesh.string();
    model.model =
        estimator::load_target_model(load_target(mesh, estimator::reference_length_m),
                                     settings.options.model, estimator::default_cache_directory());
    model.scale = load_target(mesh, scan.length).length / estimator::reference_length_m;
  }
  return models;
}

struct Outcome {
  Verdict verdict = Verdict::lost;
  bool first_right = false;
  int returns = 0;
  Vector6d error = Vector6d::Constant(std::nan(""));  ///< of the first hypothesis
  Matrix6d covariance = Matrix6d::Constant(std::nan(""));
  double nees = std::nan("");  ///< of estimate and truth together
  bool within = false;         ///< 3 sigma of both
  std::string reason;
  /// Tracking from there: empty, or why it is lost; the rest as above.
  std::string track_reason;
  Vector6d track_error = Vector6d::Constant(std::nan(""));
  Matrix6d track_covariance = Matrix6d::Constant(std::nan(""));
};

/// The truth nearest in attitude, of those that a symmetry makes equal.
const Pose& nearest_truth(const RealScan& scan, const Pose& pose) {
  return *std::min_element(scan.truths.begin(), scan.truths.end(),
                           [&pose](const Pose& a, const Pose& b) {
                             return angle_between(a, pose) < angle_between(b, pose);
                           });
}

bool is_right(const RealScan& scan, const Pose& pose) {
  const Pose& truth = nearest_truth(scan, pose);
  return distance(truth, pose) <= scan.tolerance_m &&
         angle_between(truth, pose) <= scan.tolerance_rad;
}

AcquisitionResult::Status status_of(SingleScanResult::Status status) {
  switch (status) {
    case SingleScanResult::Status::ok:
      return AcquisitionResult::Status::found;
    case SingleScanResult::Status::ambiguous:
      return AcquisitionResult::Status::ambiguous;
    default:
      return AcquisitionResult::Status::not_found;
  }
}

/// From a pose as good as one that counts as right. Lengths as the model has them meanwhile.
void track(const Settings& settings, BeamModel noise, const Model& model, const RealScan& scan,
           std::vector<RawBeam> beams, Pose from, Outcome& outcome) {
  const double shrink = 1 / model.scale;
  if (scan.scanner) noise = estimator::without_range_limits(*scan.scanner);
  for (RawBeam& beam : beams) {
    beam.range *= shrink;
    beam.range_sigma *= shrink;
  }
  noise.range_sigma_m *= shrink;
  noise.range_bias_m *= shrink;
  noise.aperture_m *= shrink;
  from.position *= shrink;
  Matrix6d prior = Matrix6d::Zero();
  prior.diagonal().head<3>().setConstant(std::pow(shrink * scan.tolerance_m, 2) / 3);
  prior.diagonal().tail<3>().setConstant(std::pow(scan.tolerance_rad, 2) / 3);
  const auto method =
      tracking_named(settings, settings.tracking_methods.front(), model.model, noise);
  const estimator::TrackingResult result =
      (*method)->track(estimator::preprocess(beams, {}, noise), {from, prior, {}});
  outcome.track_reason = result.reason;
  if (!result.ok) return;
  Pose pose = result.pose;
  pose.position *= model.scale;
  Matrix6d covariance = result.covariance;
  covariance.topRows<3>() *= model.scale;
  covariance.leftCols<3>() *= model.scale;
  outcome.track_error = difference(nearest_truth(scan, pose), pose);
  outcome.track_covariance = covariance;
}

/// As "berth estimate" does it, with the sensor's noise unknown.
Outcome estimate(const Settings& settings, const BeamModel& noise, const Model& model,
                 const RealScan& scan) {
  const estimator::SingleScan method(*model.model, model.scale, settings.options, noise);
  const std::vector<RawBeam> beams = beams_of(scan);
  const SingleScanResult result = method.estimate(estimator::preprocess(beams, {}, noise));
  Outcome outcome;
  outcome.returns = static_cast<int>(beams.size());
  outcome.reason = result.reason;
  std::vector<Pose> poses;
  for (const auto& candidate : result.candidates) poses.push_back(candidate.pose);
  outcome.verdict = verdict_on(status_of(result.status), poses,
                               [&scan](const Pose& pose) { return is_right(scan, pose); });
  if (poses.empty()) return outcome;
  outcome.first_right = is_right(scan, poses.front());
  outcome.error = difference(nearest_truth(scan, poses.front()), poses.front());
  track(settings, noise, model, scan, beams, poses.front(), outcome);
  if (const auto& covariance = result.candidates.front().covariance) {
    outcome.covariance = *covariance;
    const Matrix6d both = *covariance + scan.truth_covariance;
    outcome.nees = normalised_error_squared(outcome.error, both);
    outcome.within = within_three_sigma(outcome.error, both);
  }
  return outcome;
}

double millimetres(const Vector6d& error) { return 1e3 * error.head<3>().norm(); }
double turned_by(const Vector6d& error) { return degrees(error.tail<3>().norm()); }

std::string described(const Outcome& outcome) {
  if (outcome.verdict != Verdict::lost || !outcome.first_right) return name_of(outcome.verdict);
  return "lost though right first";
}

/// Of scans whose first hypothesis is right: how good tracking is from there.
void report_tracking(const Settings& settings, const std::vector<RealScan>& scans,
                     const std::vector<Outcome>& outcomes) {
  Table each("real_tracking",
             "Real scans, tracking from the first hypothesis (1 sigma of it: what counts as right, "
             "by the root of 3): errors, what it claims, the error squared over the covariances of "
             "estimate and truth together (NEES) and whether that is within 3 sigma (20.06)",
             {"set", "scan", "first hypothesis", "mm", "deg", "claimed mm", "claimed deg", "NEES",
              "within 3 sigma", "reason"});
  std::map<std::string, std::pair<int, int>> sums;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const RealScan& scan = scans[i];
    const Outcome& o = outcomes[i];
    const Matrix6d both = o.track_covariance + scan.truth_covariance;
    const bool tracked = both.allFinite();
    const bool within = tracked && within_three_sigma(o.track_error, both);
    each.add({scan.set, scan.name, o.first_right ? "right" : "wrong",
              number(millimetres(o.track_error), 1), number(turned_by(o.track_error), 2),
              number(1e3 * std::sqrt(o.track_covariance.topLeftCorner<3, 3>().trace()), 1),
              number(degrees(std::sqrt(o.track_covariance.bottomRightCorner<3, 3>().trace())), 2),
              number(tracked ? normalised_error_squared(o.track_error, both) : std::nan(""), 1),
              tracked ? (within ? "yes" : "no") : "-", o.track_reason});
    auto& [good, all] = sums[scan.set];
    good += within ? 1 : 0;
    ++all;
  }
  for (const auto& [set, sum] : sums) {
    each.add({set, "all", "-", "-", "-", "-", "-", "-", share(sum.first, sum.second), ""});
  }
  each.publish(settings.out);
}

void report(const Settings& settings, const std::vector<RealScan>& scans,
            const std::vector<Outcome>& outcomes) {
  Table each("real_scans",
             "Real scans: errors of the first hypothesis, what it claims (root of the trace, 1 "
             "sigma), the error squared over the covariances of estimate and truth together (NEES) "
             "and whether that is within 3 sigma (20.06), and the "
             "published method's own error",
             {"set", "scan", "returns", "verdict", "mm", "deg", "claimed mm", "claimed deg", "NEES",
              "within 3 sigma", "published mm", "published deg", "reason"});
  struct Sum {
    Tally tally;
    std::vector<double> mm;
    std::vector<double> deg;
    std::vector<double> published_mm;
    std::vector<double> published_deg;
    int within = 0;
    int claimed = 0;
  };
  std::map<std::string, Sum> sums;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const RealScan& scan = scans[i];
    const Outcome& o = outcomes[i];
    const bool claimed = o.covariance.allFinite();
    each.add({scan.set, scan.name, std::to_string(o.returns), described(o),
              number(millimetres(o.error), 1), number(turned_by(o.error), 2),
              number(1e3 * std::sqrt(o.covariance.topLeftCorner<3, 3>().trace()), 1),
              number(degrees(std::sqrt(o.covariance.bottomRightCorner<3, 3>().trace())), 2),
              number(o.nees, 1), claimed ? (o.within ? "yes" : "no") : "-",
              number(1e3 * scan.published_m, 1), number(degrees(scan.published_rad), 2), o.reason});
    for (const std::string& group : scan.groups()) {
      Sum& sum = sums[group];
      sum.tally.add(o.verdict, o.first_right);
      if (o.first_right) {
        sum.mm.push_back(millimetres(o.error));
        sum.deg.push_back(turned_by(o.error));
        if (claimed) {
          ++sum.claimed;
          sum.within += o.within ? 1 : 0;
        }
      }
      if (!std::isnan(scan.published_m)) {
        sum.published_mm.push_back(1e3 * scan.published_m);
        sum.published_deg.push_back(degrees(scan.published_rad));
      }
    }
  }
  std::vector<std::string> columns = Tally::columns();
  columns.insert(columns.begin(), "set");
  for (const char* c : {"median mm", "median deg", "within 3 sigma", "published median mm",
                        "published median deg"}) {
    columns.emplace_back(c);
  }
  Table table("real",
              "Real scans by set; errors and consistency of the first hypotheses that are right",
              columns);
  for (const auto& [group, sum] : sums) {
    std::vector<std::string> row = sum.tally.cells();
    row.insert(row.begin(), group);
    row.push_back(number(median(sum.mm), 1));
    row.push_back(number(median(sum.deg), 2));
    row.push_back(share(sum.within, sum.claimed));
    row.push_back(number(median(sum.published_mm), 1));
    row.push_back(number(median(sum.published_deg), 2));
    table.add(row);
  }
  each.publish(settings.out);
  table.publish(settings.out);
}

}  // namespace

int run_real(const Settings& settings) {
  const char* folder = std::getenv("BERTH_REAL_DATA");
  if (folder == nullptr || !fs::is_directory(folder)) {
    std::printf(
        "\nreal: skipped, %s\n",
        folder == nullptr
            ? "BERTH_REAL_DATA names no folder of real scans"
            : ("BERTH_REAL_DATA: found '" + std::string(folder) + "', which is no folder").c_str());
    return 0;
  }
  std::vector<RealScan> scans;
  add_umich(fs::path(folder) / "umich", scans);
  add_realsense(fs::path(folder) / "realsense", scans);
  std::erase_if(scans,
                [&](const RealScan& s) { return !settings.is_selected(s.set + " " + s.name); });
  if (scans.empty()) std::printf("\nreal: no scans in %s\n", folder);
  if (fs::is_directory(fs::path(folder) / "ouster")) {
    std::printf("real: the captures of ouster/ are not read: no adapter for them yet\n");
  }
  if (scans.empty()) return 0;
  const BeamModel noise = estimator::without_range_limits(
      load_lidar_profile(settings.config / "lidars" / (settings.options.lidar + ".yaml")).beam);
  const Models models = models_of(settings, scans);
  const auto outcomes =
      results_of("real scans", static_cast<int>(scans.size()), settings.jobs, [&](int i) {
        const RealScan& scan = scans[static_cast<std::size_t>(i)];
        return estimate(settings, noise, models.at(scan.mesh.string()), scan);
      });
  report(settings, scans, outcomes);
  report_tracking(settings, scans, outcomes);
  return 0;
}

}  // namespace berth::benchmark
