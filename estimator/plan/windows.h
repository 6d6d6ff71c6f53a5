// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/pose.h"
#include "common/core/scan_window.h"

namespace berth::estimator {

/// What the LIDAR can reach, a rectangle about the boresight, and what its beams are like.
struct FieldOfView {
  double width = radians(40);   ///< full, rad
  double height = radians(40);  ///< full, rad
  double minimum_step = 20e-6;  ///< between neighbouring beams, rad
  BeamModel beam;
};

struct PlannerOptions {
  int max_windows = 24;            ///< of one kind
  double margin_sigmas = 2;        ///< windows grow by so much of the pose's uncertainty
  double min_margin_m = 0.02;      ///< and by this; in information planning, never less than this
  double min_share_in_view = 0.4;  ///< of a window; less and it is left out
  double surface_share = 0.4;      ///< of the beams, for the sparse part of a combined strategy
  double dense_factor = 10;        ///< beams of the strategy "dense" for one of the others
  double equal_share = 1;          ///< of the beams on corners or edges: to all alike; the rest to
                                   ///< those that add most to the information about the pose
  // Information planning.
  double spread_share = 0.5;  ///< of the beams, over the surface whatever they add: the model, or
                              ///< the prediction, may be wrong where it matters most
  int view_cells = 3000;      ///< beams cast at the predicted pose to see what they would add
  double min_cosine = 0.1;    ///< of the incidence; flatter beams are not counted on
  double bare_surface_sigma_m = 0.004;  ///< of the true surface about a bare mesh, 1 sigma
  double design_tolerance = 0.02;       ///< of the covariance's trace
};

/// A part of space about the target, model frame.
struct ModelSphere {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;  ///< m
};

/// A raster between these angles, rad.
Window window_between(double left, double right, double low, double high, int beams,
                      const std::string& name);

/// The window about a sphere in a pose, cut to the field of view. Nothing when none of it is in
/// view.
std::optional<Window> window_around(const ModelSphere& sphere, const Pose& pose,
                                    const FieldOfView& field, int beams, const std::string& name);

/// Directions (unit, sensor axes) of a window's beams, swept as a raster (as drivers/lidar does):
/// rows from the top, to and fro, each beam in the middle of a cell of its own. Appends
/// window.count.
void append_raster(const Window& window, std::vector<Vector3d>& directions);

}  // namespace berth::estimator
