// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/scan_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/core/beam_model.h"
#include "common/core/nan.h"
#include "common/core/statistics.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/view_angles.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "logs/file/log_reader.h"

namespace berth::report {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Colours of residuals, from far in front of the surface to far beyond it.
constexpr std::size_t classes = 7;
constexpr std::size_t max_dots = 4000;

/// The angles that the picture covers: the target, the windows, and a margin.
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

/// An even sample, of as many as a reader can distinguish.
Html returns_of(const ScanPicture& picture, const View& view, double scale) {
  std::array<svg::Path, classes> paths;
  svg::Path elsewhere;
  svg::Path misses;
  const auto path_for = [&](const Beam& beam, double residual) -> svg::Path& {
    if (beam.range <= 0) return misses;
    if (!std::isfinite(residual)) return elsewhere;
    const double part = (std::clamp(residual / scale, -1.0, 1.0) + 1) / 2;
    return paths[std::min(static_cast<std::size_t>(part * classes), classes - 1)];
  };
  const std::size_t every = 1 + picture.beams.size() / max_dots;
  for (std::size_t i = 0; i < picture.beams.size(); i += every) {
    const Beam& beam = picture.beams[i];
    path_for(beam, i < picture.residuals.size() ? picture.residuals[i] : nan)
        .dot(view.x(beam.azimuth), view.y(beam.elevation));
  }
  Html html = element("path", {{"class", "miss"}, {"d", misses}}) +
              element("path", {{"class", "elsewhere"}, {"d", elsewhere}});
  for (std::size_t i = 0; i < classes; ++i) {
    html += element("path", {{"class", "return r" + std::to_string(i)}, {"d", paths[i]}});
  }
  return html;
}

Html windows_of(const ScanPicture& picture, const View& view) {
  Html html;
  for (const scan_window_t& w : picture.windows) {
    html += element("rect",
                    {{"class", "window"},
                     {"x", view.x(w.azimuth_rad - w.width_rad / 2)},
                     {"y", view.y(w.elevation_rad + w.height_rad / 2)},
                     {"width", view.scale * w.width_rad},
                     {"height", view.scale * w.height_rad}},
                    element("title", "", text(w.name)));
  }
  return html;
}

/// Those of the model, solid and with names as estimated, dashed in truth.
Html axes_of(const Pose& pose, const View& view, double length, bool estimated) {
  Html html;
  double azimuth = 0;
  double elevation = 0;
  beam_angles(pose.position, azimuth, elevation);
  const svg::Path from = svg::Path().add('M', {view.x(azimuth), view.y(elevation)});
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d tip = pose * Vector3d(length * Vector3d::Unit(axis));
    if (tip.z() <= 0) continue;
    beam_angles(tip, azimuth, elevation);
    const double x = view.x(azimuth);
    const double y = view.y(elevation);
    html += element("path", {{"class", estimated ? "axis estimated" : "axis true"},
                             {"d", svg::Path(from).add('L', {x, y})}});
    if (estimated) html += element("text", {{"x", x}, {"y", y}}, text(std::string(1, "xyz"[axis])));
  }
  return html;
}

/// Half the width of the residuals' scale: contains nine in ten.
double residual_scale(const std::vector<double>& residuals) {
  std::vector<double> sizes = finite(residuals);
  if (sizes.empty()) return 0.01;
  for (double& size : sizes) size = std::abs(size);
  return std::max(1e-3, quantile(std::move(sizes), 0.9));
}

Html key_of(double scale) {
  Html swatches;
  for (std::size_t i = 0; i < classes; ++i) {
    swatches += element("i", {{"class", "r" + std::to_string(i)}}, {});
  }
  const std::string reach = brief(1e3 * scale, 2);
  return element("span", "ramp",
                 text("\xE2\x88\x92" + reach) + swatches + text("+" + reach + " mm"));
}

}  // namespace

std::map<std::int64_t, std::vector<Beam>> read_beams(const std::filesystem::path& log,
                                                     std::int64_t session,
                                                     const std::set<std::int64_t>& scans) {
  std::map<std::int64_t, std::vector<Beam>> beams;
  if (scans.empty()) return beams;
  logs::LogReader reader(log);
  logs::LogEvent event;
  while (reader.next(event)) {
    const auto packet = logs::decode<ScanPacket>(event, channels::scan_data);
    if (!packet || packet->session != session || scans.count(packet->scan_id) == 0) continue;
    auto& of_scan = beams[packet->scan_id];
    for (std::size_t i = 0; i < packet->status.size(); ++i) {
      const bool hit = packet->status[i] == ScanPacket::HIT;
      const ScanPacket::Seen seen = packet->seen_from_sensor(i);
      of_scan.push_back(
          {packet->utime + packet->time_us[i], hit ? seen.range : 0, seen.azimuth, seen.elevation});
    }
  }
  return beams;
}

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
  Html drawing;
  if (picture.target) drawing += shaded(target, *picture.target, view);
  drawing += returns_of(picture, view, scale) + windows_of(picture, view);
  const double length = 0.2 * target.bounds().size().maxCoeff();
  if (picture.target) drawing += axes_of(*picture.target, view, length, false);
  if (picture.estimate) drawing += axes_of(*picture.estimate, view, length, true);
  return element("figure", "scan",
                 element("figcaption", "", element("b", "", text(picture.title)) + key_of(scale)) +
                     svg::image(view.width, view.height, drawing) +
                     element("p", "note-wide", text(picture.caption))) +
         markup("\n");
}

}  // namespace berth::report
