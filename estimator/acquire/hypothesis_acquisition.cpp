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

// Choices of cost.
constexpr int coarse_beams = 300;  // in the target's sphere, of which poses are first weighed
constexpr int middle_beams = 800;
constexpr int final_beams = 4000;
constexpr std::size_t laid_points = 200;
/// Of what is searched, and of the beams that should meet the target, what a pose explains that
/// needs no wider search.
constexpr double explains_enough = 0.9;
/// Of the best pose's log odds: one so much below it is no rival.
constexpr double no_rival = 0.5;

/// By which one part of a bent target is off, where the other is where it should be.
constexpr double bent_of_length = 0.15;

/// Of what is searched, the share of a surface that is looked behind.
constexpr double worth_a_search = 0.1;

/// The first of every cube with that side.
std::vector<Vector3d> one_a_cube(const std::vector<Vector3d>& points, double side) {
  std::set<std::array<int, 3>> taken;
  std::vector<Vector3d> kept;
  for (const Vector3d& p : points) {
    const auto at = [&](int axis) { return static_cast<int>(std::floor(p[axis] / side)); };
    if (taken.insert({at(0), at(1), at(2)}).second) kept.push_back(p);
  }
  return kept;
}

std::vector<Vector3d> evenly(const std::vector<Vector3d>& points, std::size_t max) {
  if (points.size() <= max) return points;
  std::vector<Vector3d> some;
  for (std::size_t i = 0; i < max; ++i) some.push_back(points[i * points.size() / max]);
  return some;
}

/// Every so many-th beam, so that about so many are in a sphere of that radius at the range of the
/// returns.
int thinning_for(const RangeImage& image, double radius, int beams) {
  const double middle = 0.5 * (image.nearest() + image.farthest());
  const double inside =
      std::min(static_cast<double>(image.beams().size()),
               std::numbers::pi * std::pow(radius / (middle * image.spacing()), 2));
  return std::max(1, static_cast<int>(inside / beams));
}

constexpr double lowest = -std::numeric_limits<double>::infinity();  // of log odds
double rival_from(double highest) { return highest - no_rival * std::abs(highest); }

/// Those nearest to the middle of all.
std::vector<Vector3d> middle_of(std::vector<Vector3d> points, std::size_t count) {
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

struct HypothesisAcquisition::Searched {
  Searched(const HypothesisAcquisition& by, const CleanScan& scan)
      : image(scan, by.beam_model_),
        large(large_planes(image, too_wide * by.model_.radius)),
        background(log_background(image, large)),
        odds(PoseOdds(by.model_, image, by.surface_sigma_).with_background(background)),
        coarse(thinning_for(image, by.model_.radius, coarse_beams)),
        middle(thinning_for(image, by.model_.radius, middle_beams)),
        fine(thinning_for(image, by.model_.radius, final_beams)),
        all(by.without(image, large)),
        behind(by.behind_surfaces(image, all)),
        planes(plane_segments(image, behind.much_nearer)) {}
  Searched(const Searched&) = delete;
  Searched& operator=(const Searched&) = delete;

  RangeImage image;
  LargePlanes large;
  std::vector<double> background;  // log density, of each beam
  PoseOdds odds;
  int coarse, middle, fine;  // every so many-th beam
  Part all;
  Behind behind;
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

double HypothesisAcquisition::required() const {
  return std::log((1 - options_.risk) / options_.risk);
}

HypothesisAcquisition::Part HypothesisAcquisition::without(const RangeImage& image,
                                                           const LargePlanes& planes) const {
  Part part;
  part.hiding.assign(image.beams().size(), 0);
  for (std::size_t b = 0; b < image.beams().size(); ++b) {
    const Beam& beam = image.beams()[b];
    if (!planes.holds(b) && beam.hit() && beam.range >= image.nearest() &&
        beam.range <= image.farthest()) {
      part.points.push_back(beam.point());
      part.beams.push_back(static_cast<int>(b));
    }
  }
  return part;
}

/// What is left without a surface, connected in the image, and what is nearer than that: it may
/// hide the target. Two surfaces of one target are seldom half of its length apart, in the mean:
/// what is nearer than the rest by more is something else, if the rest is the target.
HypothesisAcquisition::Behind HypothesisAcquisition::behind_surfaces(const RangeImage& image,
                                                                     const Part& all) const {
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
      options_.min_returns, worth_a_search * static_cast<double>(all.beams.size())));
  Behind behind;
  behind.much_nearer.assign(image.beams().size(), 0);
  Part rest = all;
  for (const Surface& s : surfaces) {
    for (const int b : s.beams) rest.hiding[static_cast<std::size_t>(b)] = 1;
    if (s.beams.size() < enough) continue;
    Part part;
    part.hiding = rest.hiding;
    double sum = 0;
    for (std::size_t i = 0; i < all.beams.size(); ++i) {
      if (part.hiding[static_cast<std::size_t>(all.beams[i])] != 0) continue;
      part.beams.push_back(all.beams[i]);
      part.points.push_back(all.points[i]);
      sum += range(all.beams[i]);
    }
    if (static_cast<int>(part.beams.size()) < options_.min_returns) break;
    const double away = sum / static_cast<double>(part.beams.size()) - s.middle;
    if (away > 0.5 * model_.target.length) behind.much_nearer = part.hiding;
    behind.parts.push_back(std::move(part));
  }
  return behind;
}

/// The points about a pose, laid on the target's surface from there.
Pose HypothesisAcquisition::laid(const Pose& pose, const std::vector<Vector3d>& points,
                                 double gate) const {
  const Pose middle{pose * model_.centre, Quaterniond::Identity()};
  std::vector<Vector3d> near;
  for (const Vector3d& p : points) {
    const Vector3d q = p - middle.position;
    if (q.squaredNorm() < std::pow(1.1 * model_.radius, 2)) near.push_back(q);
  }
  return middle * lay_points(model_.grid, evenly(near, laid_points), pose.inverse() * middle, gate,
                             0.015 * model_.target.length, 6)
                      .inverse();
}

std::vector<Pose> HypothesisAcquisition::proposed(const Searched& scan, const PoseOdds& odds,
                                                  const Part& part,
                                                  const std::vector<Hypothesis>& hints,
                                                  const Effort& effort) const {
  const double length = model_.target.length;
  const std::vector<Vector3d>& points = part.points;
  const std::vector<Vector3d> spread = one_a_cube(points, 0.05 * length);
  const std::vector<Vector3d> anchors =
      effort.everywhere ? evenly(spread, effort.anchors) : middle_of(spread, effort.anchors);
  std::vector<Pose> poses;
  for (const Hypothesis& h : hints) poses.push_back(h.pose);
  for (const Placement& p :
       match_templates(scan.image, points, anchors, part.hiding, model_.views, model_.centre,
                       model_.radius, length, effort.max_cost, effort.placements)) {
    poses.push_back(p.pose);
  }
  struct Weighed {
    Pose pose;
    double log_odds;
  };
  std::vector<Weighed> weighed;
  for (const Pose& p : poses) {
    const Pose pose = laid(p, points, 0.06 * length);
    weighed.push_back({pose, odds.log_odds(pose, 0.02 * length, scan.coarse)});
  }
  std::stable_sort(weighed.begin(), weighed.end(),
                   [](const Weighed& a, const Weighed& b) { return a.log_odds > b.log_odds; });
  std::vector<Pose> best;
  for (const Weighed& w : weighed) {
    if (best.size() == effort.semifinalists) break;
    if (std::none_of(best.begin(), best.end(), [&](const Pose& b) { return same(b, w.pose); })) {
      best.push_back(w.pose);
    }
  }
  return best;
}

/// Half turns about the axes that the target is spread along, through a place (m, model frame).
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

/// What a pose is easily confused with: half turns, and its near symmetries.
std::vector<Pose> HypothesisAcquisition::alike(const Pose& pose) const {
  std::vector<Pose> poses = half_turned(pose, model_.centre);
  for (const Symmetry& s : model_.symmetries.motions) {
    if (!s.exact) poses.push_back(pose * s.motion);
  }
  return poses;
}

/// The best of them, so many, climbed where ranges are widened.
std::vector<Pose> HypothesisAcquisition::climbed(const Searched& scan, const PoseOdds& odds,
                                                 const std::vector<Pose>& poses,
                                                 const Effort& effort) const {
  const double length = model_.target.length;
  struct Climber {
    Pose pose;
    double log_odds;
  };
  std::vector<Climber> best;
  const auto add = [&](const Pose& start, double annealing, int thinning, int rounds) {
    const auto [pose, at] = odds.climbed(start, annealing * length, thinning, rounds);
    const Climber here{pose, at.log_odds};
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
  // Of the best so far, so many, each climbed further.
  const auto climb = [&](std::size_t count, double annealing, int thinning, int rounds) {
    sort();
    if (best.size() > count) best.resize(count);
    for (const Climber& c : std::exchange(best, {})) add(c.pose, annealing, thinning, rounds);
  };
  for (const Pose& p : poses) add(p, 0.02, scan.coarse, effort.rounds);
  sort();
  std::vector<Pose> others;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, best.size()); ++i) {
    for (const Pose& p : alike(best[i].pose)) others.push_back(p);
  }
  for (const Pose& p : others) add(p, 0.02, scan.coarse, effort.rounds);
  climb(4 * effort.finalists, 0.02, scan.middle, 0);
  climb(effort.finalists, 0.007, scan.middle, 3);
  sort();
  std::vector<Pose> result;
  for (const Climber& c : best) {
    if (c.log_odds >= rival_from(best.front().log_odds)) result.push_back(c.pose);
  }
  return result;
}

/// Where the best leaves returns about it: the pose that they have by themselves. Of a target that
/// is bent, the one of its other part.
std::vector<Pose> HypothesisAcquisition::of_the_rest(const Searched& scan, const Mode& best) const {
  std::vector<char> explained(best.of_beams.size(), 0);
  for (std::size_t b = 0; b < explained.size(); ++b) explained[b] = best.of_beams[b] > 0 ? 1 : 0;
  std::vector<Vector3d> points;
  for (const int b : scan.all.beams) {
    if (explained[static_cast<std::size_t>(b)] != 0) continue;
    const Vector3d p = scan.image.beams()[static_cast<std::size_t>(b)].point();
    if ((p - best.pose * model_.centre).norm() < model_.radius) points.push_back(p);
  }
  if (static_cast<int>(points.size()) < options_.min_returns) return {};
  const Pose start = laid(best.pose, points, bent_of_length * model_.target.length);
  const PoseOdds odds = scan.odds.without(explained);
  return {odds.climbed(start, 0.02 * model_.target.length, scan.middle, 1).pose};
}

/// What the best is easily confused with, where it may be as probable. The side that is seen may
/// look as it does turned about its own middle, not the target's.
std::vector<Pose> HypothesisAcquisition::rivals(const Searched& scan, const Mode& best) const {
  const double annealing = 0.007 * model_.target.length;
  const double highest = scan.odds.log_odds(best.pose, annealing, scan.middle);
  Vector3d sum = Vector3d::Zero();
  int returns = 0;
  for (std::size_t b = 0; b < best.of_beams.size(); ++b) {
    if (best.of_beams[b] <= 0 || !scan.image.beams()[b].hit()) continue;
    sum += scan.image.beams()[b].point();
    ++returns;
  }
  std::vector<Pose> starts = alike(best.pose);
  for (const Pose& p : of_the_rest(scan, best)) starts.push_back(p);
  if (returns > 0) {
    for (const Pose& p : half_turned(best.pose, best.pose.inverse() * Vector3d(sum / returns))) {
      starts.push_back(p);
    }
  }
  std::vector<Pose> result;
  for (const Pose& start : starts) {
    const auto [pose, at] = scan.odds.climbed(start, annealing, scan.middle, 0);
    if (!same(pose, best.pose) && at.log_odds >= rival_from(highest)) result.push_back(pose);
  }
  return result;
}

/// Evidence: odds at the mode times its share of all poses that were possible [MacKay, Information
/// Theory, Inference, and Learning Algorithms, ch. 28].
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

HypothesisAcquisition::Mode HypothesisAcquisition::mode_at(const Searched& scan,
                                                           const PoseOdds& odds,
                                                           const Pose& pose) const {
  Mode mode;
  mode.pose = pose;
  mode.of_beams.assign(scan.image.beams().size(), 0);
  mode.at = odds.at(pose, 0, scan.fine, mode.of_beams);
  mode.log_evidence = log_evidence(scan.image, mode.at);
  return mode;
}

/// The modes that are highest about these poses, have the returns that are needed, and are no worse
/// than rivals of one with those log odds and of each other: of all of them, the most probable
/// first.
void HypothesisAcquisition::add_modes(const Searched& scan, const std::vector<Pose>& poses,
                                      std::vector<Mode>& modes, double highest) const {
  for (const Pose& start : poses) {
    const auto [near, at] = scan.odds.climbed(start, 0, scan.fine, 0);
    if (at.log_odds < rival_from(highest)) continue;
    const Mode mode = mode_at(scan, scan.odds, scan.odds.climbed(near, 0, scan.fine, 3).pose);
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

/// What may hide the target may be taken for it, too. A plane of many returns is foretold by more
/// of them than those beside each: as background it costs what it takes to say where it is, and no
/// pose gains more by saying it.
std::vector<HypothesisAcquisition::Mode> HypothesisAcquisition::priced(
    const Searched& scan, std::vector<Mode> modes) const {
  const PlaneSegments& planes = scan.planes;
  if (planes.nats.empty()) return modes;
  struct Gain {
    double log_odds = 0;
    double beams = 0;
  };
  std::vector<Gain> highest(planes.nats.size());
  bool behind = false;  // the target may be, as likely as is required
  for (const Mode& m : modes) {
    double of_planes = 0;
    std::vector<Gain> gains(planes.nats.size());
    for (std::size_t b = 0; b < planes.of_beam.size(); ++b) {
      if (planes.of_beam[b] < 0 || m.of_beams[b] == 0) continue;
      Gain& gain = gains[static_cast<std::size_t>(planes.of_beam[b])];
      gain.log_odds += m.of_beams[b];
      gain.beams += scan.fine;
      of_planes += m.of_beams[b];
    }
    behind = behind || (of_planes <= 0 && m.log_evidence > required());
    for (std::size_t g = 0; g < gains.size(); ++g) {
      if (gains[g].log_odds > highest[g].log_odds) highest[g] = gains[g];
    }
  }
  if (!behind) return modes;
  std::vector<double> log_background = scan.background;
  for (std::size_t b = 0; b < log_background.size(); ++b) {
    if (planes.of_beam[b] < 0) continue;
    const auto g = static_cast<std::size_t>(planes.of_beam[b]);
    const double more = highest[g].log_odds - planes.nats[g];
    if (more > 0) log_background[b] += more / highest[g].beams;
  }
  const PoseOdds against_planes = scan.odds.with_background(log_background);
  for (Mode& m : modes) m = mode_at(scan, against_planes, m.pose);
  sort(modes);
  return modes;
}

AcquisitionResult HypothesisAcquisition::decided(const std::vector<Mode>& modes) const {
  AcquisitionResult result;
  if (modes.empty()) {
    result.reason = "no view of the target lies on the returns";
    return result;
  }
  const double best = modes.front().log_evidence;
  struct Weighed {
    const Mode* mode;
    double odds;  // against the best
  };
  std::vector<Weighed> weighed;
  double evidence = 0;  // of all, over the best's
  double all = 0;
  for (const Mode& m : modes) {
    weighed.push_back({&m, rival_odds(best - m.log_evidence, modes.front().of_beams, m.of_beams,
                                      m.at.log_odds - m.log_evidence, required())});
    evidence += std::exp(m.log_evidence - best);
    all += weighed.back().odds;
  }
  std::stable_sort(weighed.begin(), weighed.end(),
                   [](const Weighed& a, const Weighed& b) { return a.odds > b.odds; });
  const double none = 1 / (1 + evidence * std::exp(std::min(best, 700.0)));
  for (const auto& [mode, odds] : weighed) {
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
                    " against no target there, " + fixed(required(), 1) + " are required: of " +
                    fixed(first.at.expected, 0) + " beams that should meet it " +
                    fixed(100 * w.hit, 0) + " % did, " + fixed(100 * w.front, 0) +
                    " % stopped before it, " + fixed(100 * w.through, 0) + " % went through, " +
                    fixed(100 * w.missing, 0) + " % did not return";
    return result;
  }
  if (weighed.front().odds / all < 1 - options_.risk) {
    result.status = AcquisitionResult::Status::ambiguous;
    result.reason = "the best pose leads the next by log odds of " +
                    fixed(-std::log(weighed[1].odds), 1) + ", " + fixed(required(), 1) +
                    " are required";
    return result;
  }
  result.status = AcquisitionResult::Status::found;
  return result;
}

AcquisitionResult HypothesisAcquisition::acquire(const CleanScan& cleaned,
                                                 const std::vector<Hypothesis>& hints) const {
  if (static_cast<int>(cleaned.points.size()) < options_.min_returns) {
    AcquisitionResult result;
    result.reason = std::to_string(cleaned.points.size()) +
                    " returns inside the range gate, at least " +
                    std::to_string(options_.min_returns) + " are needed";
    return result;
  }
  const Searched scan(*this, cleaned);
  std::vector<Mode> modes;
  std::vector<Mode> weighed;
  const auto add = [&](const std::vector<Pose>& poses, double highest) {
    add_modes(scan, poses, modes, highest);
    weighed = priced(scan, modes);
  };
  const auto search = [&](const Part& part, const Effort& effort) {
    const PoseOdds odds = scan.odds.without(part.hiding);
    const std::vector<Pose> poses = proposed(scan, odds, part, hints, effort);
    add(climbed(scan, odds, poses, effort), lowest);
  };
  const auto explained = [&] {
    if (decided(weighed).status != AcquisitionResult::Status::found) return false;
    const PoseOdds::At& at = weighed.front().at;
    const double hit = at.present * at.shares.hit;
    return hit > explains_enough &&
           hit * at.expected > explains_enough * static_cast<double>(scan.all.points.size());
  };
  search(scan.all, first_look);
  if (!explained()) search(scan.all, full_search);
  if (!explained() || !scan.planes.nats.empty()) {
    for (const Part& part : scan.behind.parts) search(part, full_search);
  }
  if (!weighed.empty()) {
    const Mode best = weighed.front();
    add(rivals(scan, best), best.at.log_odds);
  }
  AcquisitionResult result = decided(weighed);
  result.noise_scale = scan.image.noise_scale();
  return result;
}

AcquisitionResult HypothesisAcquisition::weigh(const CleanScan& cleaned,
                                               const std::vector<Pose>& poses) const {
  const Searched scan(*this, cleaned);
  std::vector<Mode> modes;
  add_modes(scan, climbed(scan, scan.odds, poses, full_search), modes, lowest);
  return decided(priced(scan, modes));
}

}  // namespace berth::estimator
