// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/scan_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "common/core/beam_model.h"
#include "common/core/nan.h"
#include "common/core/statistics.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/view_angles.h"

namespace berth::report {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Colours of residuals, from far in front of the surface to far beyond it.
constexpr int classes = 7;
constexpr std::size_t max_dots = 4000;

std::string number(double value) {
  char out[32];
  const int length = std::snprintf(out, sizeof out, "%.1f", value);
  if (out[length - 1] == '0') out[length - 2] = '\0';
  return out;
}

/// What fits the picture: the target, the windows, and a little air.
AngleBox frame_of(const ScanPicture& picture, const RayCaster& target) {
  AngleBox box;
  if (picture.target) box.add(angles_of(target.bounds(), *picture.target));
  for (const scan_window_t& w : picture.windows) {
    box.add(w.azimuth_rad - w.width_rad / 2, w.elevation_rad - w.height_rad / 2);
    box.add(w.azimuth_rad + w.width_rad / 2, w.elevation_rad + w.height_rad / 2);
  }
  if (box.empty()) {
    for (const Beam& beam : picture.beams) box.add(beam.azimuth, beam.elevation);
  }
  box.widen(0.05);
  return box;
}

std::string dot(double x, double y) { return "M" + number(x) + " " + number(y) + "h0"; }

/// Of as many as a reader can tell apart, evenly.
std::string returns_of(const ScanPicture& picture, const View& view, double scale) {
  std::array<std::string, classes> paths;
  std::string elsewhere;
  std::string misses;
  const std::size_t every = 1 + picture.beams.size() / max_dots;
  for (std::size_t i = 0; i < picture.beams.size(); i += every) {
    const Beam& beam = picture.beams[i];
    const std::string at = dot(view.x(beam.azimuth), view.y(beam.elevation));
    const double residual = i < picture.residuals.size() ? picture.residuals[i] : nan;
    if (beam.range <= 0) {
      misses += at;
    } else if (!std::isfinite(residual)) {
      elsewhere += at;
    } else {
      const double part = (residual / scale + 1) / 2;
      const int place = std::clamp(static_cast<int>(part * classes), 0, classes - 1);
      paths[static_cast<std::size_t>(place)] += at;
    }
  }
  std::string svg = "<path class=\"miss\" d=\"" + misses + "\"/><path class=\"elsewhere\" d=\"" +
                    elsewhere + "\"/>";
  for (int i = 0; i < classes; ++i) {
    svg += "<path class=\"return r" + std::to_string(i) + "\" d=\"" +
           paths[static_cast<std::size_t>(i)] + "\"/>";
  }
  return svg;
}

std::string windows_of(const ScanPicture& picture, const View& view) {
  std::string svg;
  for (const scan_window_t& w : picture.windows) {
    const double x = view.x(w.azimuth_rad - w.width_rad / 2);
    const double y = view.y(w.elevation_rad + w.height_rad / 2);
    svg += "<rect class=\"window\" x=\"" + number(x) + "\" y=\"" + number(y) + "\" width=\"" +
           number(view.scale * w.width_rad) + "\" height=\"" + number(view.scale * w.height_rad) +
           "\"><title>" + text(w.name).code + "</title></rect>";
  }
  return svg;
}

std::string axes_of(const Pose& pose, const View& view, double length, const char* kind) {
  std::string svg;
  double azimuth = 0;
  double elevation = 0;
  beam_angles(pose.position, azimuth, elevation);
  const std::string from = "M" + number(view.x(azimuth)) + " " + number(view.y(elevation));
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d tip = pose * Vector3d(length * Vector3d::Unit(axis));
    if (tip.z() <= 0) continue;
    beam_angles(tip, azimuth, elevation);
    svg += std::string("<path class=\"axis ") + kind + "\" d=\"" + from + "L" +
           number(view.x(azimuth)) + " " + number(view.y(elevation)) + "\"/>";
    if (std::string_view(kind) == "estimated") {
      svg += "<text x=\"" + number(view.x(azimuth)) + "\" y=\"" + number(view.y(elevation)) +
             "\">" + "xyz"[axis] + "</text>";
    }
  }
  return svg;
}

/// Half the width of the residuals' scale: what nine in ten lie within.
double residual_scale(const std::vector<double>& residuals) {
  std::vector<double> sizes = finite(residuals);
  if (sizes.empty()) return 0.01;
  for (double& size : sizes) size = std::abs(size);
  return std::max(1e-3, quantile(std::move(sizes), 0.9));
}

Html key_of(double scale) {
  std::string swatches;
  for (int i = 0; i < classes; ++i) swatches += "<i class=\"r" + std::to_string(i) + "\"></i>";
  const std::string reach = brief(1e3 * scale, 2);
  return markup("<span class=\"ramp\">\xE2\x88\x92" + reach + swatches + "+" + reach +
                " mm</span>");
}

}  // namespace

std::vector<double> residuals_of(const std::vector<Beam>& beams, const RayCaster& target,
                                 const Pose& pose, const Velocity& velocity, Utime utime,
                                 double elsewhere) {
  std::vector<double> residuals;
  residuals.reserve(beams.size());
  for (const Beam& beam : beams) {
    if (beam.range <= 0) {
      residuals.push_back(nan);
      continue;
    }
    const Pose then = moved(pose, velocity, seconds(beam.utime - utime)).inverse();
    const Vector3d direction = beam_direction(beam.azimuth, beam.elevation);
    const Vector3d point = then * Vector3d(beam.range * direction);
    const Vector3d off = point - target.nearest(point);
    const double distance = off.norm();
    const bool beyond = off.dot(then.rotation * direction) > 0;
    residuals.push_back(distance > elsewhere ? infinity : beyond ? distance : -distance);
  }
  return residuals;
}

Html html_of(const ScanPicture& picture, const RayCaster& target) {
  const View view = view_of(frame_of(picture, target));
  const double scale = residual_scale(picture.residuals);
  std::string svg = "<svg class=\"scan\" viewBox=\"0 0 " + number(view.width) + " " +
                    number(view.height) + "\" role=\"img\">";
  if (picture.target) svg += shaded(target, *picture.target, view);
  svg += returns_of(picture, view, scale) + windows_of(picture, view);
  const double length = 0.2 * target.bounds().size().maxCoeff();
  if (picture.target) svg += axes_of(*picture.target, view, length, "true");
  if (picture.estimate) svg += axes_of(*picture.estimate, view, length, "estimated");
  return markup("<figure class=\"scan\"><figcaption><b>") + text(picture.title) + markup("</b>") +
         key_of(scale) + markup("</figcaption>\n" + svg + "</svg>") +
         element("p", "note-wide", text(picture.caption)) + markup("</figure>\n");
}

}  // namespace berth::report
