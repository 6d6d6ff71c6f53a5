// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "evaluation/report/sections.h"

namespace berth::report {
namespace {

Curve dots(const char* name, int colour) {
  Curve curve;
  curve.name = name;
  curve.style = Curve::Style::dots;
  curve.colour = colour;
  return curve;
}

}  // namespace

Html return_section(const RunView& view) {
  const auto& estimates = view.details().estimates;
  if (estimates.empty()) return {};
  Curve residual = dots("rms", 1);
  Curve received = dots("returns", 0);
  Curve used = dots("used", 1);
  Curve misses = dots("misses", 2);
  for (const EstimateDetail& e : estimates) {
    const double t = view.at(e.utime);
    const auto add = [t](Curve& curve, double y) {
      curve.x.push_back(t);
      curve.y.push_back(y);
    };
    if (const auto* compared = view.measurer().compared_at(e.utime)) {
      const double rms = view.measurer().residual(*compared);
      if (std::isfinite(rms)) add(residual, 1e3 * rms);
    }
    add(received, e.returns_received);
    add(used, e.returns_used);
    add(misses, e.misses);
  }
  Chart residuals =
      view.chart("distance of the target's returns from its surface as estimated", "mm");
  residuals.clip_extremes = true;
  residuals.curves = {residual};
  Chart returns = view.chart("beams of each scan", "");
  returns.clip_extremes = true;
  returns.curves = {received, misses, used};
  if (residual.x.empty()) return grid_of({returns});
  return grid_of({residuals, returns});
}

}  // namespace berth::report
