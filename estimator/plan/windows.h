// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/lidar_profile.h"
#include "common/core/pose.h"

namespace berth::estimator {

/// The LIDAR's field of view, a rectangle about the boresight, and its beams.
struct FieldOfView {
  double width = radians(40);   ///< full, rad
  double height = radians(40);  ///< full, rad
  double minimum_step = 20e-6;  ///< between neighbouring beams, rad
  BeamModel beam;
};

/// Options of ScanPlanner and InformationPlanner.
struct PlannerOptions {
  int max_windows = 24;        ///< of one kind
  double margin_sigmas = 2;    ///< margin of windows, in standard deviations of the pose
  double min_margin_m = 0.02;  ///< added to it; in information planning the minimum of both
  double min_share_in_view =
      0.4;                     ///< windows with a smaller share in the field of view are left out
  double surface_share = 0.4;  ///< of the beams, for the sparse part of a combined strategy
  double dense_factor = 10;    ///< beams of the strategy "dense" over those of the others
  double equal_share =
      1;  ///< of the beams on corners or edges, distributed evenly; others by information
  // Information planning.
  double spread_share =
      0.5;                ///< of the beams, spread evenly: robust to errors of model and prediction
  int view_cells = 3000;  ///< beams cast at the predicted pose to evaluate information
  double min_cosine = 0.1;              ///< of incidence; beams beyond are not counted on
  double bare_surface_sigma_m = 0.004;  ///< of the true surface about a bare mesh, 1 sigma
  double design_tolerance = 0.02;       ///< of the covariance's trace
};

/// A sphere in the model frame.
struct ModelSphere {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;  ///< m
};

/// A raster between these azimuths and elevations, rad.
Window window_between(double left, double right, double low, double high, int beams,
                      const std::string& name);

/// The window about a sphere in a pose, clipped to the field of view. Empty when out of view.
std::optional<Window> window_around(const ModelSphere& sphere, const Pose& pose,
                                    const FieldOfView& field, int beams, const std::string& name);

/// Appends the directions (unit, sensor axes) of a window's window.count beams, swept as a raster
/// as by drivers/lidar: rows from the top, in alternating directions, each beam in the middle of
/// its cell.
void append_raster(const Window& window, std::vector<Vector3d>& directions);

}  // namespace berth::estimator
