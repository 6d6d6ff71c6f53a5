// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/foxglove_schemas.h"

#include <nlohmann/json.hpp>

namespace berth::logs {
namespace {

using Json = nlohmann::ordered_json;

const Json text = {{"type", "string"}};
const Json number = {{"type", "number"}};
const Json integer = {{"type", "integer"}};

Json object(const char* title, Json properties) {
  return {{"type", "object"}, {"title", title}, {"properties", std::move(properties)}};
}

Json time() { return object("time", {{"sec", integer}, {"nsec", integer}}); }

Json vector() { return object("foxglove.Vector3", {{"x", number}, {"y", number}, {"z", number}}); }

Json quaternion() {
  return object("foxglove.Quaternion",
                {{"x", number}, {"y", number}, {"z", number}, {"w", number}});
}

Json pose() {
  return object("foxglove.Pose", {{"position", vector()}, {"orientation", quaternion()}});
}

}  // namespace

std::string pose_in_frame_schema() {
  return object("foxglove.PoseInFrame",
                {{"timestamp", time()}, {"frame_id", text}, {"pose", pose()}})
      .dump();
}

std::string frame_transform_schema() {
  return object("foxglove.FrameTransform", {{"timestamp", time()},
                                            {"parent_frame_id", text},
                                            {"child_frame_id", text},
                                            {"translation", vector()},
                                            {"rotation", quaternion()}})
      .dump();
}

std::string point_cloud_schema() {
  const Json field = object("foxglove.PackedElementField",
                            {{"name", text}, {"offset", integer}, {"type", integer}});
  const Json data = {{"type", "string"}, {"contentEncoding", "base64"}};
  return object("foxglove.PointCloud", {{"timestamp", time()},
                                        {"frame_id", text},
                                        {"pose", pose()},
                                        {"point_stride", integer},
                                        {"fields", {{"type", "array"}, {"items", field}}},
                                        {"data", data}})
      .dump();
}

std::string log_schema() {
  return object("foxglove.Log", {{"timestamp", time()},
                                 {"level", integer},
                                 {"message", text},
                                 {"name", text},
                                 {"file", text},
                                 {"line", integer}})
      .dump();
}

}  // namespace berth::logs
