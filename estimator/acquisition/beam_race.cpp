// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/beam_race.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <tuple>

#include "estimator/acquisition/beam_fit.h"
#include "estimator/acquisition/scan_order.h"
#include "estimator/tracking/beam_tracking.h"

namespace berth::estimator {

namespace {

constexpr std::size_t most_returns = 1500;
constexpr std::size_t block = 64;   // beams
constexpr double hopeless = 25;     // log-likelihood behind the best
constexpr double beside_it = 0.09;  // of the length: farther off a return may be of anything

bool leads(const Contender& a, const Contender& b) {
  return a.log_likelihood() > b.log_likelihood();
}

}  // namespace

BeamRace::BeamRace(const TargetModel& model, const BeamModel& beam_model, const CleanScan& scan,
                   const std::vector<Hypothesis>& earlier)
    : model_(model),
      beam_model_(beam_model),
      scan_(scan),
      earlier_(earlier),
      order_(shuffled(scan.beams)),
      gated_(scan.beams.size()) {
  for (const std::uint32_t i : scan.beam_of_point) gated_[i] = true;
  for (const std::uint32_t i : order_) {
    if (returns_.size() == most_returns) break;
    if (gated_[i]) returns_.push_back(scan.beams[i]);
  }
}

std::size_t BeamRace::beams_with(std::size_t returns, std::size_t least) const {
  std::size_t met = 0;
  std::size_t count = 0;
  for (; count < order_.size() && (met < returns || count < least); ++count) {
    met += gated_[order_[count]] ? 1 : 0;
  }
  return count;
}

std::vector<Contender> BeamRace::run(const std::vector<Pose>& poses,
                                     const LikelihoodOptions& likelihood, std::size_t most_beams,
                                     std::size_t enough_beams, Mercy mercy,
                                     std::size_t kept) const {
  std::vector<Contender> running;
  for (const Pose& pose : poses) {
    running.push_back(
        {pose, BeamLikelihood(model_, beam_model_, likelihood, pose), prior_of(pose)});
  }
  const auto decided = [&] {
    return std::all_of(running.begin() + 1, running.end(), [&](const Contender& c) {
      return same(c.pose, running.front().pose, one_place);
    });
  };
  const std::size_t end = std::min(most_beams, order_.size());
  for (std::size_t from = 0; from < end && !running.empty(); from += block) {
    if (from >= enough_beams && decided()) break;
    for (Contender& c : running) {
      for (std::size_t i = from; i < std::min(from + block, end); ++i) {
        c.weight.add(scan_.beams[order_[i]]);
      }
    }
    std::stable_sort(running.begin(), running.end(), leads);
    if (running.size() <= kept) continue;
    const double least = running.front().log_likelihood() - hopeless;
    const auto others = running.begin() + static_cast<std::ptrdiff_t>(kept);
    const auto left_out = std::remove_if(others, running.end(), [&](const Contender& c) {
      return c.log_likelihood() + mercy.of_contradiction * c.contradictions() +
                 mercy.of_beam * c.weight.sum().predicted <
             least;
    });
    running.erase(left_out, running.end());
  }
  return running;
}

std::vector<Pose> BeamRace::fitted(const std::vector<Pose>& poses, std::size_t returns,
                                   double first_gate, double last_gate, int iterations) const {
  const std::span<const Beam> some(returns_.data(), std::min(returns, returns_.size()));
  std::vector<Pose> result;
  for (const Pose& pose : poses) {
    result.push_back(
        fit_beams(model_, beam_model_, some, pose, first_gate, last_gate, iterations).pose);
  }
  return result;
}

Pose BeamRace::polished(const Pose& pose, const LikelihoodOptions& likelihood, std::size_t beams,
                        const PolishOptions& how) const {
  const std::span<const std::uint32_t> some(order_.data(), std::min(beams, order_.size()));
  return estimator::polished(model_, beam_model_, likelihood, scan_.beams, some, pose, how);
}

/// So many beams that they hold enough returns.
const CleanScan& BeamRace::few() const {
  constexpr std::size_t enough = 1000;
  if (few_) return *few_;
  std::vector<std::uint32_t> picks = order_;
  picks.resize(beams_with(enough, 0));
  // Row by row, in whatever order they came.
  std::sort(picks.begin(), picks.end(), [this](std::uint32_t a, std::uint32_t b) {
    const Vector3d& p = scan_.beams[a].direction;
    const Vector3d& q = scan_.beams[b].direction;
    return std::tie(p.y(), p.x(), scan_.beams[a].range) <
           std::tie(q.y(), q.x(), scan_.beams[b].range);
  });
  few_.emplace();
  few_->utime_first = scan_.utime_first;
  few_->utime_last = scan_.utime_last;
  few_->utime_mean = scan_.utime_mean;
  for (const std::uint32_t i : picks) {
    if (gated_[i]) {
      few_->points.push_back(scan_.beams[i].point());
      few_->beam_of_point.push_back(static_cast<std::uint32_t>(few_->beams.size()));
    }
    few_->misses += scan_.beams[i].hit() ? 0 : 1;
    few_->beams.push_back(scan_.beams[i]);
  }
  return *few_;
}

Pose BeamRace::followed(const Pose& pose, double noise_scale) const {
  // A lead is worth no more than poses are settled, also where edges alone tell of a direction.
  static const BeamTrackingOptions options = [] {
    BeamTrackingOptions all_edges;
    all_edges.descent.edge_rest.least_gain = 0;
    return all_edges;
  }();
  const double shift = 0.01 * model_.target.length;
  const double turn = 2 * shift / model_.radius;
  Prediction start;
  start.pose = pose;
  start.covariance = Matrix6d::Zero();
  start.covariance.diagonal() << Vector3d::Constant(shift * shift), Vector3d::Constant(turn * turn);
  const BeamModel noise = noisier(beam_model_, noise_scale);
  const TrackingResult result = BeamTracking(model_, noise, options).track(few(), start);
  return result.ok ? result.pose : pose;
}

bool BeamRace::same(const Pose& a, const Pose& b, double slack) const {
  const Pose near = model_.symmetries.nearest_equal(a, b);
  return near.rotation.angularDistance(b.rotation) < slack * radians(4) &&
         (near * model_.centre - b * model_.centre).norm() < slack * 0.03 * model_.target.length;
}

std::vector<Pose> BeamRace::distinct(const std::vector<Pose>& poses, std::size_t most,
                                     double slack) const {
  std::vector<Pose> result;
  for (const Pose& pose : poses) {
    if (result.size() == most) break;
    if (std::none_of(result.begin(), result.end(),
                     [&](const Pose& other) { return same(pose, other, slack); })) {
      result.push_back(pose);
    }
  }
  return result;
}

std::vector<Contender> BeamRace::distinct(const std::vector<Contender>& contenders,
                                          double slack) const {
  std::vector<Contender> result;
  for (const Contender& c : contenders) {
    if (std::none_of(result.begin(), result.end(),
                     [&](const Contender& other) { return same(c.pose, other.pose, slack); })) {
      result.push_back(c);
    }
  }
  return result;
}

LikelihoodOptions BeamRace::as_seen_from(const Contender& leader,
                                         const LikelihoodOptions& options) const {
  constexpr double prior = 20;  // beams' worth of what the options say
  const auto share = [](int count, int of, double expected) {
    return (count + prior * expected) / (of + prior);
  };
  const Likelihood& seen = leader.weight.sum();
  LikelihoodOptions result = options;
  result.noise_scale = noise_seen_from(leader, options);
  const int strays = seen.predicted - seen.explained - seen.missed;
  result.background = share(seen.past_returned, seen.past, result.background);
  result.drop_out = std::min(0.3, share(seen.missed, seen.predicted, result.drop_out));
  result.outlier = std::min(0.5, share(strays, seen.predicted, result.outlier));
  return result;
}

template <class Visit>
void BeamRace::for_its_beams(const Contender& contender, Visit visit) const {
  const Likelihood& seen = contender.weight.sum();
  for (int i = 0; i < seen.predicted + seen.past; ++i) {
    const std::uint32_t index = order_[static_cast<std::size_t>(i)];
    visit(scan_.beams[index], gated_[index]);
  }
}

/// From the median of the ranges' residuals: half of them may be anything.
double BeamRace::noise_seen_from(const Contender& leader, const LikelihoodOptions& options) const {
  constexpr double usual = 1.5;  // and less: the pose's own error
  constexpr double most = 5;
  constexpr std::size_t least_returns = 20;
  const Pose to_model = leader.pose.inverse();
  const double far = (model_.centre - to_model.position).norm() + model_.radius;
  const double about = 0.05 * model_.target.length;
  std::vector<double> sigmas;
  for_its_beams(leader, [&](const Beam& beam, bool) {
    RayHit hit;
    const Vector3d direction = to_model.rotation * beam.direction;
    if (!beam.hit() || !model_.caster.cast({to_model.position, direction}, far, hit)) return;
    const double cosine = std::clamp(-direction.dot(hit.normal), 0.05, 1.0);
    const double miss = (beam.range - hit.range) * cosine;
    if (std::abs(miss) > about) return;
    const double noise = beam_model_.range_variance(hit.range, std::acos(cosine)) * cosine * cosine;
    sigmas.push_back((miss * miss - options.model_sigma_m * options.model_sigma_m) / noise);
  });
  if (sigmas.size() < least_returns) return 1;
  const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
  std::nth_element(sigmas.begin(), middle, sigmas.end());
  constexpr double median_of_squares = 0.4549;  // of a standard normal variable
  const double scale = std::sqrt(std::max(0.0, *middle / median_of_squares));
  return scale > usual ? std::min(scale, most) : 1;
}

double BeamRace::inlier_share(const Contender& contender) const {
  const Vector3d centre = contender.pose * model_.centre;
  int near = 0;
  for_its_beams(contender, [&](const Beam& beam, bool) {
    if (beam.hit() && (beam.point() - centre).norm() < model_.radius) ++near;
  });
  return near > 0 ? static_cast<double>(contender.weight.sum().explained) / near : 0;
}

double BeamRace::misfit_share(const Contender& contender,
                              const LikelihoodOptions& likelihood) const {
  // Of the length: nearer to the surface a return may be of it, farther off it may be anything.
  const double noise = likelihood.noise_scale * beam_model_.range_sigma_m / model_.target.length;
  const double on_it = std::max(0.015, likelihood.noise_scale > 1 ? 2.5 * noise : 0);
  const Pose to_model = contender.pose.inverse();
  const double unit = model_.distances.cut_off() / DistanceTable::most / model_.target.length;
  int on = 0;
  int beside = 0;
  for_its_beams(contender, [&](const Beam& beam, bool) {
    if (!beam.hit()) return;
    const Vector3d point = to_model * beam.point();
    const double distance = unit * model_.distances.value(point.cast<float>());
    if (distance < on_it) {
      ++on;
    } else if (distance < beside_it) {
      ++beside;
    }
  });
  return beside > 0 ? static_cast<double>(beside) / (on + beside) : 0;
}

double BeamRace::share_about(const Contender& contender) const {
  const Pose to_model = contender.pose.inverse();
  const double unit = model_.distances.cut_off() / DistanceTable::most / model_.target.length;
  int inside = 0;
  int about = 0;
  for_its_beams(contender, [&](const Beam& beam, bool gated) {
    if (!gated) return;
    ++inside;
    const Vector3d point = to_model * beam.point();
    if (unit * model_.distances.value(point.cast<float>()) < beside_it) ++about;
  });
  return inside > 0 ? static_cast<double>(about) / inside : 0;
}

double BeamRace::rim_share(const Contender& contender) const {
  // A beam passes the rim so near to the surface, of the length; nearer, noise may decide.
  constexpr double nearest = 0.01;
  constexpr double farthest = 0.05;
  const Pose to_model = contender.pose.inverse();
  const double unit = model_.distances.cut_off() / DistanceTable::most / model_.target.length;
  int free = 0;
  int stopped = 0;
  for_its_beams(contender, [&](const Beam& beam, bool) {
    const ClosePass pass = close_pass(model_, contender.pose, beam.direction);
    if (pass.distance < nearest || pass.distance > farthest) return;
    if (beam.hit() &&
        unit * model_.distances.value((to_model * beam.point()).cast<float>()) < beside_it) {
      ++stopped;
    } else if (beam.range > pass.range) {
      ++free;
    }
  });
  return stopped > 0 ? static_cast<double>(stopped) / (stopped + free) : 0;
}

double BeamRace::explained_share(const Contender& contender) const {
  int inside = 0;
  for_its_beams(contender, [&](const Beam&, bool gated) { inside += gated ? 1 : 0; });
  return inside > 0 ? static_cast<double>(contender.weight.sum().explained) / inside : 0;
}

double BeamRace::scanned_share(const Contender& contender) const {
  constexpr std::size_t looked_at = 300;  // places on the surface
  const auto for_some_beams = [&](auto&& visit) {
    constexpr std::size_t some = 500;  // spread over the scan, show its outline
    for (std::size_t i = 0; i < std::min(some, order_.size()); ++i) {
      visit(scan_.beams[order_[i]].direction);
    }
  };
  Vector3d middle = Vector3d::Zero();
  for_some_beams([&](const Vector3d& direction) { middle += direction; });
  const Matrix3d turn = Quaterniond::FromTwoVectors(middle, Vector3d::UnitZ()).toRotationMatrix();
  // On a plane across the middle direction.
  const auto place = [](const Vector3d& p) -> Eigen::Vector2d { return p.head<2>() / p.z(); };
  Eigen::AlignedBox2d outline;
  for_some_beams([&](const Vector3d& direction) {
    if (const Vector3d p = turn * direction; p.z() > 0.1) outline.extend(place(p));
  });
  const std::vector<SurfaceSample>& samples = model_.surface.samples;
  const std::size_t stride = 1 + samples.size() / looked_at;
  int inside = 0;
  int all = 0;
  for (std::size_t i = 0; i < samples.size(); i += stride) {
    const Vector3d p = turn * (contender.pose * samples[i].position.cast<double>());
    ++all;
    if (p.z() > 0 && outline.contains(place(p))) ++inside;
  }
  return static_cast<double>(inside) / std::max(1, all);
}

double BeamRace::evidence(const Contender& contender, const LikelihoodOptions& likelihood) const {
  Pose nowhere;
  nowhere.position = {0, 0, -1e6};
  BeamLikelihood without(model_, beam_model_, likelihood, nowhere);
  for_its_beams(contender, [&](const Beam& beam, bool) { without.add(beam); });
  return contender.weight.sum().log_likelihood - without.sum().log_likelihood;
}

double BeamRace::prior_of(const Pose& pose) const {
  constexpr double new_place = 10;  // behind all that the earlier scan left open
  double best = -std::numeric_limits<double>::infinity();
  double least = std::numeric_limits<double>::infinity();
  for (const Hypothesis& h : earlier_) {
    best = std::max(best, h.log_likelihood);
    least = std::min(least, h.log_likelihood);
  }
  for (const Hypothesis& h : earlier_) {
    if (same(pose, h.pose, 2)) return h.log_likelihood - best;
  }
  return earlier_.empty() ? 0 : least - best - new_place;
}

}  // namespace berth::estimator
