// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>

#include "common/core/error.h"
#include "common/targets/target.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/scan_picture.h"
#include "evaluation/report/sections.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/words.h"

namespace berth::report {
namespace {

constexpr std::size_t max_pictures = 8;

/// The scans of most interest, each with the reason why it is drawn.
class Choice {
 public:
  explicit Choice(const RunView& view) : view_(view) {}

  std::map<std::int64_t, std::string> scans() {
    worst();
    const auto& estimates = view_.details().estimates;
    first_of(pose_estimate_t::LOST, "lost");
    first_of(pose_estimate_t::AMBIGUOUS, "ambiguous");
    for (const evaluation::Phase& phase : view_.phases()) {
      std::vector<std::size_t> inside;
      for (std::size_t i = 0; i < estimates.size(); ++i) {
        if (phase.contains(estimates[i].utime)) inside.push_back(i);
      }
      if (!inside.empty()) add(estimates[inside[inside.size() / 2]], "amid " + phase.name);
    }
    return chosen_;
  }

 private:
  void add(const EstimateDetail& estimate, const std::string& why) {
    std::string& reason = chosen_[estimate.scan_id];
    reason += (reason.empty() ? "" : ", ") + why;
    if (chosen_.size() > max_pictures) chosen_.erase(estimate.scan_id);
  }

  void first_of(std::int8_t status, const std::string& why) {
    for (const EstimateDetail& e : view_.details().estimates) {
      if (e.status != status) continue;
      add(e, "the first " + why);
      return;
    }
  }

  void worst() {
    const evaluation::ComparedEstimate* worst = nullptr;
    for (const evaluation::ComparedEstimate& c : view_.measurer().compared()) {
      if (worst == nullptr || c.error.head<3>().norm() > worst->error.head<3>().norm()) worst = &c;
    }
    if (worst == nullptr) return;
    for (const EstimateDetail& e : view_.details().estimates) {
      if (e.utime == worst->estimate.utime) return add(e, "the largest position error");
    }
  }

  const RunView& view_;
  std::map<std::int64_t, std::string> chosen_;
};

std::string caption_of(const EstimateDetail& e, const evaluation::Measurer& measurer) {
  const evaluation::ComparedEstimate* compared = measurer.compared_at(e.utime);
  std::string caption =
      std::string(words::of_estimate_status(e.status)) + (e.reason.empty() ? "" : ": " + e.reason) +
      "; " + std::to_string(e.returns_used) + " of " + std::to_string(e.returns_received) +
      " returns used, " + std::to_string(e.misses) + " misses";
  if (compared != nullptr) {
    const double residual = measurer.residual(*compared);
    if (std::isfinite(residual)) caption += ", residual " + brief(1e3 * residual, 3) + " mm rms";
    caption += "; off by " + brief(1e3 * compared->error.head<3>().norm(), 3) + " mm and " +
               brief(degrees(compared->error.tail<3>().norm()), 3) + " deg";
  }
  const bool has_truth = measurer.record().truth().at(e.utime).has_value();
  return caption + (has_truth ? "" : "; no truth: drawn where it was estimated");
}

/// As it was compared with truth, where it was.
const evaluation::EstimateSample* sample_at(const RunView& view, Utime utime) {
  if (const auto* compared = view.measurer().compared_at(utime)) return &compared->estimate;
  for (const evaluation::EstimateSample& sample : view.record().estimates()) {
    if (sample.utime == utime) return &sample;
  }
  return nullptr;
}

}  // namespace

Html scan_section(const RunView& view) {
  const auto* info = view.record().info();
  if (!info) return {};
  std::optional<RayCaster> caster;
  try {
    const Target target = evaluation::target_of_run(*info, view.source().log.parent_path());
    if (target.hash == info->target_hash) caster.emplace(target.mesh);
  } catch (const InputError&) {
  }
  if (!caster) return element("p", "note-wide", text("The target's mesh is not at hand."));
  const auto chosen = Choice(view).scans();
  std::set<std::int64_t> ids;
  for (const auto& [id, why] : chosen) ids.insert(id);
  const auto beams = read_beams(view.source().log, info->session, ids);
  const double elsewhere = 0.1 * caster->bounds().size().maxCoeff();
  Html html;
  for (const EstimateDetail& e : view.details().estimates) {
    if (ids.erase(e.scan_id) == 0) continue;  // of a stream, the first estimate
    const auto scan = view.details().scans.find(e.scan_id);
    const auto returns = beams.find(e.scan_id);
    const evaluation::EstimateSample* sample = sample_at(view, e.utime);
    if (returns == beams.end() || sample == nullptr) continue;
    const auto truth = view.record().truth().at(e.utime);
    ScanPicture picture;
    picture.title = brief(view.at(e.utime)) + " s, scan " + std::to_string(e.scan_id) + ": " +
                    chosen.at(e.scan_id);
    picture.caption = caption_of(e, view.measurer());
    if (scan != view.details().scans.end()) picture.windows = scan->second.windows;
    picture.beams = returns->second;
    const auto paint = [&](const Pose& pose, const Velocity& velocity) {
      picture.target = pose;
      picture.residuals = residuals_of(picture.beams, *caster, pose, velocity, e.utime, elsewhere);
    };
    if (sample->ok()) {
      paint(sample->pose, sample->velocity);
      picture.estimate = sample->pose;
    } else if (truth) {
      paint(truth->pose, truth->velocity);
      picture.caption += "; coloured by the distance from the true target";
    }
    if (truth) picture.target = truth->pose;
    html += html_of(picture, *caster);
  }
  if (html.empty()) return {};
  return element("div", "grid fill", html) +
         element("p", "note-wide",
                 text("The target where it truly was, seen from the sensor; frames are the scan's "
                      "windows. Returns are coloured by their distance from the target where the "
                      "estimate puts it: blue in front of its surface, orange beyond it, grey "
                      "elsewhere; faint dots met nothing. Axes of the model: solid as estimated, "
                      "dashed in truth."));
}

}  // namespace berth::report
