// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "estimator/estimator_options.h"
#include "test/benchmarks/yardstick.h"

namespace berth::trials {}  // namespace berth::trials

namespace berth::benchmark {

using namespace trials;

/// In the place of a method's name, of departures: tracking alone, or acquisition alone.
inline constexpr const char* no_method = "none";

/// The options of the command line.
struct Settings {
  int trials = 1000;
  bool trials_given = false;  ///< rather than the number above
  std::uint64_t seed = 1;
  int jobs = 1;          ///< threads, in parts that do not measure time
  int untimed_jobs = 1;  ///< in parts that show no time at all: every core, unless jobs are given
  std::filesystem::path out;
  std::filesystem::path meshes;      ///< a directory; empty: the replica alone
  std::vector<std::string> targets;  ///< by name or mesh; empty: a part's own choice
  double stated_sigma = 1;       ///< described sigma of the surface as a multiple of the true one
  std::filesystem::path config;  ///< directory of the configuration
  estimator::EstimatorOptions options;
  std::vector<std::string> acquisition_methods;
  std::vector<std::string> tracking_methods;
  Yardstick yardstick{true};
  std::vector<std::string> only;  ///< of the cells of a part, those whose name holds one of these

  bool is_selected(const std::string& cell) const {
    const auto holds = [&cell](const std::string& text) {
      return cell.find(text) != std::string::npos;
    };
    return only.empty() || std::any_of(only.begin(), only.end(), holds);
  }
};

/// The parts. Each publishes its tables and pictures. @return how many targets were missed.
int run_acquisition(const Settings& settings);
int run_tracking(const Settings& settings);
int run_basin(const Settings& settings);
int run_speed(const Settings& settings);
int run_motion(const Settings& settings);
int run_planning(const Settings& settings);
int run_scaling(const Settings& settings);
int run_paper_acquisition(const Settings& settings);
int run_paper_strategies(const Settings& settings);
int run_paper_tracking(const Settings& settings);
int run_micro(const Settings& settings);
int run_real(const Settings& settings);
int run_departures(const Settings& settings);

/// "radarsat2" or a mesh file, 3 m long, compiled or from the cache.
std::shared_ptr<const estimator::TargetModel> model_of(const Settings& settings,
                                                       const std::string& target = "radarsat2");

/// A method under test with all that has to outlive it.
template <typename Method>
struct Subject {
  std::string name;
  estimator::EstimatorOptions options;
  BeamModel noise;
  std::shared_ptr<const estimator::TargetModel> model;
  std::unique_ptr<Method> method;

  const Method& operator*() const { return *method; }
  const Method* operator->() const { return method.get(); }
};
using AcquisitionSubject = std::unique_ptr<Subject<estimator::Acquisition>>;
using TrackingSubject = std::unique_ptr<Subject<estimator::Tracking>>;

AcquisitionSubject acquisition_named(const Settings& settings, const std::string& name,
                                     std::shared_ptr<const estimator::TargetModel> model,
                                     const BeamModel& noise);
TrackingSubject tracking_named(const Settings& settings, const std::string& name,
                               std::shared_ptr<const estimator::TargetModel> model,
                               const BeamModel& noise);

/// Tracking as published, "icp", then the methods under test.
std::vector<std::string> published_and_tested(const Settings& settings);

}  // namespace berth::benchmark
