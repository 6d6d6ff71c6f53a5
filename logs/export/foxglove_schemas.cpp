// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/foxglove_schemas.h"

#include <nlohmann/json.hpp>

#include "common/core/valid_text.h"

namespace berth::logs {
namespace {

using Json = nlohmann::ordered_json;

const Json a_text = {{"type", "string"}};
const Json a_number = {{"type", "number"}};
const Json an_integer = {{"type", "integer"}};

Json object(const char* title, Json properties) {
  return {{"type", "object"}, {"title", title}, {"properties", std::move(properties)}};
}

Json time() { return object("time", {{"sec", an_integer}, {"nsec", an_integer}}); }

Json vector() {
  return object("foxglove.Vector3", {{"x", a_number}, {"y", a_number}, {"z", a_number}});
}

Json quaternion() {
  return object("foxglove.Quaternion",
                {{"x", a_number}, {"y", a_number}, {"z", a_number}, {"w", a_number}});
}

Json pose() {
  return object("foxglove.Pose", {{"position", vector()}, {"orientation", quaternion()}});
}

}  // namespace

std::string pose_in_frame_schema() {
  return json_text(object("foxglove.PoseInFrame",
                          {{"timestamp", time()}, {"frame_id", a_text}, {"pose", pose()}}));
}

std::string frame_transform_schema() {
  return json_text(object("foxglove.FrameTransform", {{"timestamp", time()},
                                                      {"parent_frame_id", a_text},
                                                      {"child_frame_id", a_text},
                                                      {"translation", vector()},
                                                      {"rotation", quaternion()}}));
}

std::string point_cloud_schema() {
  const Json field = object("foxglove.PackedElementField",
                            {{"name", a_text}, {"offset", an_integer}, {"type", an_integer}});
  const Json data = {{"type", "string"}, {"contentEncoding", "base64"}};
  return json_text(object("foxglove.PointCloud", {{"timestamp", time()},
                                                  {"frame_id", a_text},
                                                  {"pose", pose()},
                                                  {"point_stride", an_integer},
                                                  {"fields", {{"type", "array"}, {"items", field}}},
                                                  {"data", data}}));
}

std::string log_schema() {
  return json_text(object("foxglove.Log", {{"timestamp", time()},
                                           {"level", an_integer},
                                           {"message", a_text},
                                           {"name", a_text},
                                           {"file", a_text},
                                           {"line", an_integer}}));
}

}  // namespace berth::logs
