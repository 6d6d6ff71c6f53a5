// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/hypothesis_acquisition.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "common/core/text.h"
#include "estimator/acquire/segmentation.h"
#include "estimator/model/align_points.h"

namespace berth::estimator {
namespace {

// Choices of computing time: beams on the target's sphere at each stage.
constexpr int coarse_beams = 300;
constexpr int middle_beams = 800;
constexpr int final_beams = 4000;
constexpr std::size_t alignment_points = 200;
/// A pose that explains these shares of the returns searched and of its expected beams ends the
/// search.
constexpr double sufficient_share = 0.9;
/// Poses whose log odds are lower than the best's by more than this share of it are pruned.
constexpr double rival_share = 0.5;

/// Alignment gate of a second part of a bent target, over the target's length.
constexpr double bent_of_length = 0.15;

/// Surfaces with a smaller share of the returns are not searched behind.
constexpr double min_surface_share = 0.1;

/// Voxel grid sampling: the first point of every cube with that side (m).
std::vector<Vector3d> voxel_sample(const std::vector<Vector3d>& points, double side) {
  std::set<std::array<int, 3>> taken;
  std::vector<Vector3d> kept;
  for (const Vector3d& p : points) {
    const auto at = [&](int axis) { return static_cast<int>(std::floor(p[axis] / side)); };
    if (taken.insert({at(0), at(1), at(2)}).second) kept.push_back(p);
  }
  return kept;
}

/// Every n-th beam, so that about `beams` of them are within a sphere of that radius at the
/// returns' range.
int thinning_for(const RangeImage& image, double radius, int beams) {
  const double middle = 0.5 * (image.nearest() + image.farthest());
  const double inside =
      std::min(static_cast<double>(image.beams().size()),
               std::numbers::pi * std::pow(radius / (middle * image.spacing()), 2));
  return std::max(1, static_cast<int>(inside / beams));
}

constexpr double no_odds = -std::numeric_limits<double>::infinity();  // of log odds
double rival_limit(double highest) { return highest - rival_share * std::abs(highest); }

/// The `count` points nearest to the mean of all.
std::vector<Vector3d> nearest_to_mean(std::vector<Vector3d> points, std::size_t count) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p / static_cast<double>(points.size());
  count = std::min(count, points.size());
  std::partial_sort(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(count),
                    points.end(), [&](const Vector3d& a, const Vector3d& b) {
                      return (a - mean).squaredNorm() < (b - mean).squaredNorm();
                    });
  points.resize(count);
  return points;
}

}  // namespace

struct HypothesisAcquisition::SearchData {
  SearchData(const HypothesisAcquisition& by, const PreprocessedScan& scan)
      : image(scan, by.beam_model_),
        large(large_planes(image, max_plane_radii * by.model_.radius)),
        background(log_background(image, large)),
        odds(PoseOdds(by.model_, image, by.surface_sigma_).with_background(background)),
        coarse(thinning_for(image, by.model_.radius, coarse_beams)),
        middle(thinning_for(image, by.model_.radius, middle_beams)),
        fine(thinning_for(image, by.model_.radius, final_beams)),
        all(by.without(image, large)),
        layers(by.search_behind(image, all)),
        planes(plane_segments(image, layers.possible_occluders)) {}
  SearchData(const SearchData&) = delete;
  SearchData& operator=(const SearchData&) = delete;

  RangeImage image;
  LargePlanes large;
  std::vector<double> background;  // log density, of each beam
  PoseOdds odds;
  int coarse, middle, fine;  // thinning
  Candidates all;
  Layers layers;
  PlaneSegments planes;
};

HypothesisAcquisition::HypothesisAcquisition(const TargetModel& model, const BeamModel& beam_model,
                                             const HypothesisAcquisitionOptions& options)
    : model_(model),
      beam_model_(beam_model),
      options_(options),
      surface_sigma_(surface_sigma_of(model, options.bare_surface_sigma_m)) {}

void HypothesisAcquisition::sort(std::vector<Mode>& modes) {
  std::stable_sort(modes.begin(), modes.end(),
                   [](const Mode& a, const Mode& b) { return a.log_evidence > b.log_evidence; });
}

bool HypothesisAcquisition::same(const Pose& a, const Pose& b) const {
  return model_.symmetries.distance(a, b) < 0.05 * model_.target.length &&
         model_.symmetries.angle_between(a, b) < radians(6);
}

double HypothesisAcquisition::required_log_odds() const {
  return std::log((1 - options_.risk) / options_.risk);
}

HypothesisAcquisition::Candidates HypothesisAcquisition::without(const RangeImage& image,
                                                                 const LargePlanes& planes) const {
  Candidates candidates;
  candidates.occluding.assign(image.beams().size(), 0);
  for (std::size_t b = 0; b < image.beams().size(); ++b) {
    const Beam& beam = image.beams()[b];
    if (!planes.holds(b) && beam.hit() && beam.range >= image.nearest() &&
        beam.range <= image.farthest()) {
      candidates.points.push_back(beam.point());
      candidates.beams.push_back(static_cast<int>(b));
    }
  }
  return candidates;
}

/// Removes the nearest connected surfaces one after another; what remains behind each is searched
/// as partly occluded. Surfaces whose mean range is nearer than the remainder's by more than half
/// of the target's length are possible occluders: two surfaces of one target seldom are so far
/// apart.
HypothesisAcquisition::Layers HypothesisAcquisition::search_behind(const RangeImage& image,
                                                                   const Candidates& all) const {
  const double step = 0.1 * model_.target.length;
  const auto range = [&image](int b) { return image.beams()[static_cast<std::size_t>(b)].range; };
  const auto joined = [&](int a, int b) { return std::abs(range(a) - range(b)) < step; };
  std::vector<char> marked(image.beams().size(), 0);
  for (const int b : all.beams) marked[static_cast<std::size_t>(b)] = 1;
  struct Surface {
    double middle = 0;  // m, of ranges
    std::vector<int> beams;
  };
  std::vector<Surface> surfaces;
  for (std::vector<int>& beams : regions(image, marked, 2, joined)) {
    Surface& s = surfaces.emplace_back();
    for (const int b : beams) s.middle += range(b) / static_cast<double>(beams.size());
    s.beams = std::move(beams);
  }
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const Surface& a, const Surface& b) { return a.middle < b.middle; });
  const auto enough = static_cast<std::size_t>(std::max<double>(
      options_.min_returns, min_surface_share * static_cast<double>(all.beams.size())));
  Layers layers;
  layers.possible_occluders.assign(image.beams().size(), 0);
  Candidates rest = all;
  for (const Surface& s : surfaces) {
    for (const int b : s.beams) rest.occluding[static_cast<std::size_t>(b)] = 1;
    if (s.beams.size() < enough) continue;
    Candidates candidates;
    candidates.occluding = rest.occluding;
    double sum = 0;
    for (std::size_t i = 0; i < all.beams.size(); ++i) {
      if (candidates.occluding[static_cast<std::size_t>(all.beams[i])] != 0) continue;
      candidates.beams.push_back(all.beams[i]);
      candidates.points.push_back(all.points[i]);
      sum += range(all.beams[i]);
    }
    if (static_cast<int>(candidates.beams.size()) < options_.min_returns) break;
    const double away = sum / static_cast<double>(candidates.beams.size()) - s.middle;
    if (away > 0.5 * model_.target.length) layers.possible_occluders = candidates.occluding;
    layers.parts.push_back(std::move(candidates));
  }
  return layers;
}

/// The pose after aligning the returns within its sphere to the target's surface.
Pose HypothesisAcquisition::aligned(const Pose& pose, const std::vector<Vector3d>& points,
                                    double gate) const {
  const Pose middle{pose * model_.centre, Quaterniond::Identity()};
  std::vector<Vector3d> near;
  for (const Vector3d& p : points) {
    const Vector3d q = p - middle.position;
    if (q.squaredNorm() < std::pow(1.1 * model_.radius, 2)) near.push_back(q);
  }
  return middle * align_points(model_.grid, sampled_evenly(near, alignment_points),
                               pose.inverse() * middle, gate, 0.015 * model_.target.length, 6)
                      .inverse();
}

std::vector<Pose> HypothesisAcquisition::proposed(const SearchData& scan, const PoseOdds& odds,
                                                  const Candidates& candidates,
                                                  const std::vector<Hypothesis>& hints,
                                                  const SearchSettings& settings) const {
  const double length = model_.target.length;
  const std::vector<Vector3d>& points = candidates.points;
  const std::vector<Vector3d> spread = voxel_sample(points, 0.05 * length);
  const std::vector<Vector3d> anchors = settings.everywhere
                                            ? sampled_evenly(spread, settings.anchors)
                                            : nearest_to_mean(spread, settings.anchors);
  std::vector<Pose> poses;
  for (const Hypothesis& h : hints) poses.push_back(h.pose);
  for (const Placement& p : match_templates(scan.image, points, anchors, candidates.occluding,
                                            model_.views, model_.centre, model_.radius, length,
                                            settings.max_cost, settings.placements)) {
    poses.push_back(p.pose);
  }
  struct ScoredPose {
    Pose pose;
    double log_odds;
  };
  std::vector<ScoredPose> scored;
  for (const Pose& p : poses) {
    const Pose pose = aligned(p, points, 0.06 * length);
    scored.push_back({pose, odds.log_odds(pose, 0.02 * length, scan.coarse)});
  }
  std::stable_sort(scored.begin(), scored.end(), [](const ScoredPose& a, const ScoredPose& b) {
    return a.log_odds > b.log_odds;
  });
  std::vector<Pose> best;
  for (const ScoredPose& w : scored) {
    if (best.size() == settings.semifinalists) break;
    if (std::none_of(best.begin(), best.end(), [&](const Pose& b) { return same(b, w.pose); })) {
      best.push_back(w.pose);
    }
  }
  return best;
}

/// Half turns about the target's principal axes through a point (m, model frame).
std::vector<Pose> HypothesisAcquisition::half_turned(const Pose& pose,
                                                     const Vector3d& place) const {
  std::vector<Pose> poses;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d about = model_.canonical.pose.rotation.conjugate() * Vector3d::Unit(axis);
    Pose turn;
    turn.rotation = Quaterniond(Eigen::AngleAxisd(radians(180), about));
    turn.position = place - turn.rotation * place;
    poses.push_back(pose * turn);
  }
  return poses;
}

/// Half turns and near symmetries of a pose.
std::vector<Pose> HypothesisAcquisition::confusable_poses(const Pose& pose) const {
  std::vector<Pose> poses = half_turned(pose, model_.centre);
  for (const Symmetry& s : model_.symmetries.motions) {
    if (!s.exact) poses.push_back(pose * s.motion);
  }
  return poses;
}

/// Successive halving: refines the poses and their confusable ones on ever more beams, keeping the
/// best.
std::vector<Pose> HypothesisAcquisition::refined(const SearchData& scan, const PoseOdds& odds,
                                                 const std::vector<Pose>& poses,
                                                 const SearchSettings& settings) const {
  const double length = model_.target.length;
  struct Candidate {
    Pose pose;
    double log_odds;
  };
  std::vector<Candidate> best;
  const auto add = [&](const Pose& start, double annealing, int thinning, int rounds) {
    const auto [pose, at] = odds.refined(start, annealing * length, thinning, rounds);
    const Candidate here{pose, at.log_odds};
    const auto twin = std::find_if(best.begin(), best.end(),
                                   [&](const auto& c) { return same(c.pose, here.pose); });
    if (twin == best.end()) {
      best.push_back(here);
    } else if (here.log_odds > twin->log_odds) {
      *twin = here;
    }
  };
  const auto sort = [&best] {
    std::stable_sort(best.begin(), best.end(),
                     [](const auto& a, const auto& b) { return a.log_odds > b.log_odds; });
  };
  // Refines the `count` best so far.
  const auto refine_best = [&](std::size_t count, double annealing, int thinning, int rounds) {
    sort();
    if (best.size() > count) best.resize(count);
    for (const Candidate& c : std::exchange(best, {})) add(c.pose, annealing, thinning, rounds);
  };
  for (const Pose& p : poses) add(p, 0.02, scan.coarse, settings.rounds);
  sort();
  std::vector<Pose> others;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, best.size()); ++i) {
    for (const Pose& p : confusable_poses(best[i].pose)) others.push_back(p);
  }
  for (const Pose& p : others) add(p, 0.02, scan.coarse, settings.rounds);
  refine_best(4 * settings.finalists, 0.02, scan.middle, 0);
  refine_best(settings.finalists, 0.007, scan.middle, 3);
  sort();
  std::vector<Pose> result;
  for (const Candidate& c : best) {
    if (c.log_odds >= rival_limit(best.front().log_odds)) result.push_back(c.pose);
  }
  return result;
}

/// The pose of the returns that the best pose leaves unexplained, if there are enough: of a bent
/// target, that of its other part.
std::vector<Pose> HypothesisAcquisition::unexplained_poses(const SearchData& scan,
                                                           const Mode& best) const {
  std::vector<char> explained(best.of_beams.size(), 0);
  for (std::size_t b = 0; b < explained.size(); ++b) explained[b] = best.of_beams[b] > 0 ? 1 : 0;
  std::vector<Vector3d> points;
  for (const int b : scan.all.beams) {
    if (explained[static_cast<std::size_t>(b)] != 0) continue;
    const Vector3d p = scan.image.beams()[static_cast<std::size_t>(b)].point();
    if ((p - best.pose * model_.centre).norm() < model_.radius) points.push_back(p);
  }
  if (static_cast<int>(points.size()) < options_.min_returns) return {};
  const Pose start = aligned(best.pose, points, bent_of_length * model_.target.length);
  const PoseOdds odds = scan.odds.without(explained);
  return {odds.refined(start, 0.02 * model_.target.length, scan.middle, 1).pose};
}

/// Poses easily confused with the best one, where their odds are comparable. Half turns are taken
/// about the centre of the visible side, too.
std::vector<Pose> HypothesisAcquisition::rivals(const SearchData& scan, const Mode& best) const {
  const double annealing = 0.007 * model_.target.length;
  const double highest = scan.odds.log_odds(best.pose, annealing, scan.middle);
  Vector3d sum = Vector3d::Zero();
  int returns = 0;
  for (std::size_t b = 0; b < best.of_beams.size(); ++b) {
    if (best.of_beams[b] <= 0 || !scan.image.beams()[b].hit()) continue;
    sum += scan.image.beams()[b].point();
    ++returns;
  }
  std::vector<Pose> starts = confusable_poses(best.pose);
  for (const Pose& p : unexplained_poses(scan, best)) starts.push_back(p);
  if (returns > 0) {
    for (const Pose& p : half_turned(best.pose, best.pose.inverse() * Vector3d(sum / returns))) {
      starts.push_back(p);
    }
  }
  std::vector<Pose> result;
  for (const Pose& start : starts) {
    const auto [pose, at] = scan.odds.refined(start, annealing, scan.middle, 0);
    if (!same(pose, best.pose) && at.log_odds >= rival_limit(highest)) result.push_back(pose);
  }
  return result;
}

/// Evidence by Laplace's approximation: odds at the mode times its share of all possible poses
/// [MacKay, Information Theory, Inference, and Learning Algorithms, ch. 28].
double HypothesisAcquisition::log_evidence(const RangeImage& image, const PoseOdds::At& at) const {
  const double length = model_.target.length;
  constexpr double all_attitudes = 8 * std::numbers::pi * std::numbers::pi;
  const double volume = image.solid_angle() / 3 *
                        (std::pow(image.farthest(), 3) - std::pow(image.nearest(), 3)) *
                        all_attitudes / model_.symmetries.exact_count();
  Matrix6d information = at.information;
  information.diagonal().head<3>().array() += 1 / (length * length);
  information.diagonal().tail<3>().array() += 1;
  double log_determinant = 0;
  for (const double d : information.ldlt().vectorD()) log_determinant += std::log(d);
  return at.log_odds + 3 * std::log(2 * std::numbers::pi) - 0.5 * log_determinant -
         std::log(volume);
}

HypothesisAcquisition::Mode HypothesisAcquisition::mode_at(const SearchData& scan,
                                                           const PoseOdds& odds,
                                                           const Pose& pose) const {
  Mode mode;
  mode.pose = pose;
  mode.of_beams.assign(scan.image.beams().size(), 0);
  mode.at = odds.at(pose, 0, scan.fine, mode.of_beams);
  mode.log_evidence = log_evidence(scan.image, mode.at);
  return mode;
}

/// Refines poses to modes and adds those with enough returns and with odds comparable to `highest`
/// and to each other; sorted by evidence.
void HypothesisAcquisition::add_modes(const SearchData& scan, const std::vector<Pose>& poses,
                                      std::vector<Mode>& modes, double highest) const {
  for (const Pose& start : poses) {
    const auto [near, at] = scan.odds.refined(start, 0, scan.fine, 0);
    if (at.log_odds < rival_limit(highest)) continue;
    const Mode mode = mode_at(scan, scan.odds, scan.odds.refined(near, 0, scan.fine, 3).pose);
    if (mode.at.shares.hit * mode.at.expected < options_.min_returns) continue;
    highest = std::max(highest, mode.at.log_odds);
    if (std::none_of(modes.begin(), modes.end(), [&](const Mode& m) {
          return same(m.pose, mode.pose) && m.at.log_odds >= mode.at.log_odds;
        })) {
      std::erase_if(modes, [&](const Mode& m) { return same(m.pose, mode.pose); });
      modes.push_back(mode);
    }
  }
  sort(modes);
}

/// Where the target may be behind possible occluders, planes among these become background
/// hypotheses at the cost of their description length: no pose gains more from a plane's returns
/// than that.
std::vector<HypothesisAcquisition::Mode> HypothesisAcquisition::with_plane_costs(
    const SearchData& scan, std::vector<Mode> modes) const {
  const PlaneSegments& planes = scan.planes;
  if (planes.code_length.empty()) return modes;
  /// What a pose gains from a plane's returns.
  struct Gain {
    double log_odds = 0;
    double beams = 0;
  };
  std::vector<Gain> highest(planes.code_length.size());
  bool behind = false;  // whether the target is behind with the required odds
  for (const Mode& m : modes) {
    double of_planes = 0;
    std::vector<Gain> gains(planes.code_length.size());
    for (std::size_t b = 0; b < planes.of_beam.size(); ++b) {
      if (planes.of_beam[b] < 0 || m.of_beams[b] == 0) continue;
      Gain& gain = gains[static_cast<std::size_t>(planes.of_beam[b])];
      gain.log_odds += m.of_beams[b];
      gain.beams += scan.fine;
      of_planes += m.of_beams[b];
    }
    behind = behind || (of_planes <= 0 && m.log_evidence > required_log_odds());
    for (std::size_t g = 0; g < gains.size(); ++g) {
      if (gains[g].log_odds > highest[g].log_odds) highest[g] = gains[g];
    }
  }
  if (!behind) return modes;
  std::vector<double> log_background = scan.background;
  for (std::size_t b = 0; b < log_background.size(); ++b) {
    if (planes.of_beam[b] < 0) continue;
    const auto g = static_cast<std::size_t>(planes.of_beam[b]);
    const double more = highest[g].log_odds - planes.code_length[g];
    if (more > 0) log_background[b] += more / highest[g].beams;
  }
  const PoseOdds against_planes = scan.odds.with_background(log_background);
  for (Mode& m : modes) m = mode_at(scan, against_planes, m.pose);
  sort(modes);
  return modes;
}

AcquisitionResult HypothesisAcquisition::decision(const std::vector<Mode>& modes) const {
  AcquisitionResult result;
  if (modes.empty()) {
    result.reason = "no view of the target matches the returns";
    return result;
  }
  const double best = modes.front().log_evidence;
  struct ScoredPose {
    const Mode* mode;
    double odds;  // against the best
  };
  std::vector<ScoredPose> scored;
  double evidence = 0;  // of all, over the best's
  double all = 0;
  for (const Mode& m : modes) {
    scored.push_back({&m, rival_odds(best - m.log_evidence, modes.front().of_beams, m.of_beams,
                                     m.at.log_odds - m.log_evidence, required_log_odds())});
    evidence += std::exp(m.log_evidence - best);
    all += scored.back().odds;
  }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const ScoredPose& a, const ScoredPose& b) { return a.odds > b.odds; });
  const double none = 1 / (1 + evidence * std::exp(std::min(best, 700.0)));
  for (const auto& [mode, odds] : scored) {
    if (static_cast<int>(result.hypotheses.size()) == options_.max_hypotheses) break;
    Hypothesis h;
    h.pose = mode->pose;
    h.log_likelihood = mode->at.log_odds;
    h.probability = (1 - none) * odds / all;
    h.equal_poses = model_.symmetries.exact_count();
    if (!result.hypotheses.empty() && odds / all < options_.risk) break;
    result.hypotheses.push_back(h);
  }
  const Mode& first = modes.front();
  const PoseShares& w = first.at.shares;
  if (none > options_.risk) {
    result.reason = "the best pose has log odds of " + fixed(first.log_evidence, 1) +
                    " against no target there, " + fixed(required_log_odds(), 1) +
                    " are required: of " + fixed(first.at.expected, 0) +
                    " beams that should meet it " + fixed(100 * w.hit, 0) + " % did, " +
                    fixed(100 * w.front, 0) + " % stopped before it, " + fixed(100 * w.through, 0) +
                    " % went through, " + fixed(100 * w.missing, 0) + " % did not return";
    return result;
  }
  if (scored.front().odds / all < 1 - options_.risk) {
    result.status = AcquisitionResult::Status::ambiguous;
    result.reason = "the best pose leads the next by log odds of " +
                    fixed(-std::log(scored[1].odds), 1) + ", " + fixed(required_log_odds(), 1) +
                    " are required";
    return result;
  }
  result.status = AcquisitionResult::Status::found;
  return result;
}

AcquisitionResult HypothesisAcquisition::acquire(const PreprocessedScan& cleaned,
                                                 const std::vector<Hypothesis>& hints) const {
  if (static_cast<int>(cleaned.points.size()) < options_.min_returns) {
    AcquisitionResult result;
    result.reason = std::to_string(cleaned.points.size()) +
                    " returns inside the range gate, at least " +
                    std::to_string(options_.min_returns) + " are needed";
    return result;
  }
  const SearchData scan(*this, cleaned);
  std::vector<Mode> modes;
  std::vector<Mode> scored;
  const auto add = [&](const std::vector<Pose>& poses, double highest) {
    add_modes(scan, poses, modes, highest);
    scored = with_plane_costs(scan, modes);
  };
  const auto search = [&](const Candidates& candidates, const SearchSettings& settings) {
    const PoseOdds odds = scan.odds.without(candidates.occluding);
    const std::vector<Pose> poses = proposed(scan, odds, candidates, hints, settings);
    add(refined(scan, odds, poses, settings), no_odds);
  };
  const auto explained = [&] {
    if (decision(scored).status != AcquisitionResult::Status::found) return false;
    const PoseOdds::At& at = scored.front().at;
    const double hit = at.present * at.shares.hit;
    return hit > sufficient_share &&
           hit * at.expected > sufficient_share * static_cast<double>(scan.all.points.size());
  };
  search(scan.all, quick_search);
  if (!explained()) search(scan.all, full_search);
  if (!explained() || !scan.planes.code_length.empty()) {
    for (const Candidates& candidates : scan.layers.parts) search(candidates, full_search);
  }
  if (!scored.empty()) {
    const Mode best = scored.front();
    add(rivals(scan, best), best.at.log_odds);
  }
  AcquisitionResult result = decision(scored);
  result.noise_scale = scan.image.noise_scale();
  return result;
}

AcquisitionResult HypothesisAcquisition::evaluate(const PreprocessedScan& cleaned,
                                                  const std::vector<Pose>& poses) const {
  const SearchData scan(*this, cleaned);
  std::vector<Mode> modes;
  add_modes(scan, refined(scan, scan.odds, poses, full_search), modes, no_odds);
  return decision(with_plane_costs(scan, modes));
}

}  // namespace berth::estimator
