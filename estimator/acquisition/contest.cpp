// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/contest.h"

#include <algorithm>

#include "estimator/acquisition/objection.h"
#include "estimator/acquisition/view_acquisition.h"

namespace berth::estimator {

namespace {

constexpr double one_place = BeamRace::one_place;
/// Beams for a race of which another follows.
constexpr std::size_t heat = 2000;
/// Log-likelihood that a beam against a pose may cost it for want of polish alone.
constexpr double unsettled = 4;

/// Beams that speak against a pose.
int against(const Contender& contender) {
  return contender.contradictions() + contender.weight.sum().past_returned;
}

std::vector<Pose> leading(std::vector<Pose> poses, std::size_t most) {
  if (poses.size() > most) poses.resize(most);
  return poses;
}

}  // namespace

std::vector<Pose> poses_of(const std::vector<Contender>& contenders) {
  std::vector<Pose> result;
  for (const Contender& c : contenders) result.push_back(c.pose);
  return result;
}

void append(std::vector<Pose>& to, const std::vector<Pose>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

Contest::Contest(const TargetModel& model, const ViewAcquisitionOptions& options,
                 const BeamRace& race)
    : model_(model), options_(options), race_(race), likelihood_(options.likelihood) {
  const std::vector<Symmetry>& motions = model.symmetries.motions;
  has_alike_ = std::any_of(motions.begin(), motions.end(),
                           [this](const Symmetry& s) { return looks_alike(s); });
}

std::vector<Contender> Contest::settle(std::vector<Pose> poses, std::size_t effort) {
  const double length = model_.target.length;
  const std::size_t beams = few_beams(effort);
  const std::size_t most = effort * static_cast<std::size_t>(options_.finalists);
  // A rough pose may be right and yet far behind one that happens to lie better.
  poses = leading(poses_of(race_.run(poses, coarsened(0.006), beams, beams, {}, most)), most);
  // A fit to few returns may go astray: the likelihood tells.
  append(poses, race_.fitted(poses, 256, 0.02 * length, 0.008 * length, 3));
  const std::vector<Contender> roughly = race_.run(poses, coarsened(0.003), beams, beams);
  if (roughly.empty()) return {};
  look_from(roughly.front());
  poses = race_.distinct(poses_of(roughly), most, one_place);
  append(poses, race_.fitted(poses, 400, 0.008 * length, 0.008 * length, 2));
  const Mercy merciful = alone_ ? mercy() : Mercy{};
  return decide(race_.distinct(poses_of(race_.run(poses, likelihood_, 2 * beams, beams, merciful)),
                               most, one_place));
}

void Contest::look_from(const Contender& leader) {
  constexpr double nearly_all = 0.95;
  likelihood_ = race_.as_seen_from(leader, options_.likelihood);
  alone_ = race_.share_about(leader) > nearly_all;
}

/// A lead is worth no more than the poses are settled: what wins no clear victory is taken to where
/// it fits best, and races again with what it may be confused with. Tracking leads farther than
/// polish and tells more sharply, but among other things it is slow, and may be misled.
std::vector<Contender> Contest::decide(std::vector<Pose> poses) {
  constexpr double most_against = 0.02;
  constexpr std::size_t polishing_beams = 2000;
  followed_ = false;
  if (!has_alike_) append(poses, counterparts(leading(poses, 2)));
  std::vector<Contender> found = race(poses, has_alike_ ? heat : race_.beams());
  if (found.empty()) return found;
  const Contender& best = found.front();
  const bool clear = found.size() == 1 && !has_alike_ && crisp(best, likelihood_.noise_scale) &&
                     !doubtful(best, most_against);
  if (clear) return found;
  followed_ = alone_;
  if (followed_) {
    return improved(std::move(found), [&](const Pose& pose) {
      return race_.followed(pose, likelihood_.noise_scale);
    });
  }
  return improved(std::move(found), [&](const Pose& pose) {
    return race_.polished(pose, likelihood_, polishing_beams, {});
  });
}

/// The best made better, with what it is confused with then, against the others; and those of them
/// that may still win made better, too.
template <class Better>
std::vector<Contender> Contest::improved(std::vector<Contender> found, Better better) {
  constexpr std::size_t most_others = 4;
  std::vector<Pose> places;
  for (const std::size_t most : {has_alike_ ? 1 : most_others, most_others}) {
    std::vector<Pose> next;
    for (const Contender& c : found) {
      const bool known = std::any_of(places.begin(), places.end(), [&](const Pose& place) {
        return race_.same(c.pose, place, one_place);
      });
      if (known || next.size() == most) continue;
      places.push_back(c.pose);
      next.push_back(better(c.pose));
    }
    if (next.empty()) break;
    append(places, next);
    const std::vector<Pose> confused = counterparts({next.front()});
    append(next, poses_of(found));
    append(next, confused);
    found = race(next, has_alike_ && most == 1 ? heat : race_.beams());
  }
  return found;
}

/// Distinct.
std::vector<Contender> Contest::race(const std::vector<Pose>& poses, std::size_t most_beams) {
  constexpr std::size_t enough_beams = 1000;
  candidates_ += static_cast<int>(poses.size());
  const Mercy merciful = alone_ || has_alike_ ? mercy() : Mercy{};
  return race_.distinct(race_.run(poses, likelihood_, most_beams, enough_beams, merciful),
                        one_place);
}

/// The poses that the target's near symmetries make of these. They are no better than the symmetry
/// is true, so each is fitted before it is weighed against others.
std::vector<Pose> Contest::counterparts(const std::vector<Pose>& poses) const {
  const double length = model_.target.length;
  std::vector<Pose> turned;
  for (const Pose& pose : poses) {
    for (const Symmetry& s : model_.symmetries.motions) {
      if (!s.exact) turned.push_back(pose * s.motion);
    }
  }
  if (turned.empty()) return {};
  append(turned, poses);
  const std::size_t beams = few_beams(1);
  turned = poses_of(race_.run(turned, coarsened(0.006), beams, beams, mercy()));
  std::erase_if(turned, [&](const Pose& pose) {
    return std::any_of(poses.begin(), poses.end(),
                       [&](const Pose& known) { return race_.same(pose, known, one_place); });
  });
  turned = leading(std::move(turned), 2 * static_cast<std::size_t>(options_.finalists));
  append(turned, race_.fitted(turned, 256, 0.02 * length, 0.008 * length, 3));
  return turned;
}

/// Where a target fills little of a scan it takes more beams to see it.
std::size_t Contest::few_beams(std::size_t effort) const {
  return race_.beams_with(effort * 100, effort * 256);
}

/// model_sigma: of the length.
LikelihoodOptions Contest::coarsened(double model_sigma) const {
  LikelihoodOptions coarse = options_.likelihood;
  coarse.drop_out = std::max(coarse.drop_out, 0.1);
  coarse.outlier = std::max(coarse.outlier, 0.1);
  coarse.model_sigma_m = std::max(coarse.model_sigma_m, model_sigma * model_.target.length);
  return coarse;
}

Mercy Contest::mercy() const {
  constexpr double quarter_sigma_off = 0.03;  // 0.25^2 / 2
  return {unsettled, quarter_sigma_off};
}

bool Contest::unresolved(const Contender& winner) const {
  constexpr double most_against = 0.01;
  return followed_ && doubtful(winner, most_against);
}

/// Whether beams contradict a pose in a scan of hardly anything but the target: there is nothing
/// else that they could have met. most: share of the beams that should meet it.
bool Contest::doubtful(const Contender& contender, double most) const {
  return alone_ && against(contender) > 1 + most * contender.weight.sum().predicted;
}

bool Contest::looks_alike(const Symmetry& symmetry) const {
  constexpr double least_unlike = 0.007;  // of the length, rms
  return !symmetry.exact && symmetry.deviation_m < least_unlike * model_.target.length;
}

double Contest::decisive_lead(const Contender& best, const Contender& other) const {
  const bool alike = std::any_of(
      model_.symmetries.motions.begin(), model_.symmetries.motions.end(), [&](const Symmetry& s) {
        return looks_alike(s) && race_.same(best.pose * s.motion, other.pose, 2);
      });
  // What beams contradict even now is not settled, or is not it.
  if (!alike) {
    return options_.decisive_margin + (unresolved(best) ? unsettled * against(best) : 0);
  }
  // Both were settled on a part of the beams.
  constexpr int both = 2;
  const int strays =
      std::max(0, other.weight.sum().past_returned - best.weight.sum().past_returned);
  return options_.decisive_margin + unsettled * (both + strays + other.contradictions());
}

}  // namespace berth::estimator
