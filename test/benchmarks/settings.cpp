// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/settings.h"

#include <utility>

namespace berth::benchmark {

std::shared_ptr<const estimator::TargetModel> model_of(const Settings& settings,
                                                       const std::string& target) {
  return estimator::load_target_model(load_target(target, 3.0), settings.options.model,
                                      estimator::default_cache_directory());
}

AcquisitionSubject acquisition_named(const Settings& settings, const std::string& name,
                                     std::shared_ptr<const estimator::TargetModel> model,
                                     const BeamModel& noise) {
  auto subject = std::make_unique<Subject<estimator::Acquisition>>();
  subject->name = name;
  subject->options = settings.options;
  subject->options.acquisition_method = name;
  subject->noise = noise;
  subject->model = std::move(model);
  subject->method = estimator::make_acquisition(subject->options, *subject->model, subject->noise);
  return subject;
}

TrackingSubject tracking_named(const Settings& settings, const std::string& name,
                               std::shared_ptr<const estimator::TargetModel> model,
                               const BeamModel& noise) {
  auto subject = std::make_unique<Subject<estimator::Tracking>>();
  subject->name = name;
  subject->options = settings.options;
  subject->options.tracking_method = name;
  subject->noise = noise;
  subject->model = std::move(model);
  subject->method = estimator::make_tracking(subject->options, *subject->model, subject->noise);
  return subject;
}

std::vector<std::string> published_and_tested(const Settings& settings) {
  std::vector<std::string> names = {"icp"};
  for (const std::string& name : settings.tracking_methods) {
    if (name != names.front()) names.push_back(name);
  }
  return names;
}

}  // namespace berth::benchmark
