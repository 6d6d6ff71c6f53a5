// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

/// JSON schemas of the messages that Foxglove-compatible viewers know, with the fields that are
/// documented at docs.foxglove.dev/docs/sdk/schemas.
namespace berth::logs {

std::string pose_in_frame_schema();
std::string frame_transform_schema();
std::string point_cloud_schema();
std::string log_schema();

}  // namespace berth::logs
