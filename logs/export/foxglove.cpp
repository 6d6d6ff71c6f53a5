// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/foxglove.h"

#include <berth/event_t.hpp>
#include <berth/ground_truth_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

#include "common/core/valid_text.h"
#include "lcmtypes/channels.h"

namespace berth::logs {
namespace {

// JSON schemas of the messages that Foxglove-compatible viewers know, with the fields that are
// documented at docs.foxglove.dev/docs/sdk/schemas.

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

using Json = nlohmann::ordered_json;

Json time_of(Utime utime) {
  const Utime rest = (utime % second + second) % second;
  return {{"sec", utime / second - (utime % second < 0 ? 1 : 0)}, {"nsec", rest * 1000}};
}

Json vector_of(double x, double y, double z) { return {{"x", x}, {"y", y}, {"z", z}}; }

Json quaternion_of(double w, double x, double y, double z) {
  return {{"x", x}, {"y", y}, {"z", z}, {"w", w}};
}

template <class Message>
Json position_of(const Message& m) {
  return vector_of(m.position_m[0], m.position_m[1], m.position_m[2]);
}

template <class Message>
Json rotation_of(const Message& m) {
  return quaternion_of(m.q_wxyz[0], m.q_wxyz[1], m.q_wxyz[2], m.q_wxyz[3]);
}

template <class Message>
Json pose_in_sensor(const Message& m) {
  return {{"timestamp", time_of(m.utime)},
          {"frame_id", "sensor"},
          {"pose", {{"position", position_of(m)}, {"orientation", rotation_of(m)}}}};
}

Json frame(Utime utime, const char* parent, const char* child, Json translation, Json rotation) {
  return {{"timestamp", time_of(utime)},
          {"parent_frame_id", parent},
          {"child_frame_id", child},
          {"translation", std::move(translation)},
          {"rotation", std::move(rotation)}};
}

std::string base64(const std::string& bytes) {
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      three = three << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? digits[three >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

/// Levels of foxglove.Log: INFO 2, WARNING 3, ERROR 4, FATAL 5.
int level_of(std::int8_t severity) {
  constexpr int levels[] = {2, 2, 3, 4, 5};
  return severity >= 0 && severity <= event_t::FATAL ? levels[severity] : 0;
}

}  // namespace

const Foxglove::Description& Foxglove::description(Topic topic) {
  static const Description descriptions[] = {
      {"/berth/truth", "foxglove.PoseInFrame", pose_in_frame_schema},
      {"/berth/estimate", "foxglove.PoseInFrame", pose_in_frame_schema},
      {"/tf", "foxglove.FrameTransform", frame_transform_schema},
      {"/berth/scan", "foxglove.PointCloud", point_cloud_schema},
      {"/berth/log", "foxglove.Log", log_schema},
  };
  return descriptions[static_cast<int>(topic)];
}

Foxglove::Foxglove(Out out)
    : out_(std::move(out)), scans_([this](const ScanCloud& scan) { put_cloud(scan); }) {}

void Foxglove::take(const LogEvent& event) {
  if (!view_is_published_) {
    view_is_published_ = true;
    out_(Topic::frames, json_text(frame(event.utime, "view", "sensor", vector_of(0, 0, 0),
                                        quaternion_of(0.5, -0.5, 0.5, -0.5))));
  }
  if (event.channel == channels::ground_truth) {
    if (const auto m = decode<ground_truth_t>(event.data)) {
      out_(Topic::truth, json_text(pose_in_sensor(*m)));
      out_(Topic::frames,
           json_text(frame(m->utime, "sensor", "target truth", position_of(*m), rotation_of(*m))));
    }
  } else if (event.channel == channels::pose_estimate) {
    const auto m = decode<pose_estimate_t>(event.data);
    if (m && m->status == pose_estimate_t::OK) {
      out_(Topic::estimate, json_text(pose_in_sensor(*m)));
      out_(Topic::frames, json_text(frame(m->utime, "sensor", "target estimate", position_of(*m),
                                          rotation_of(*m))));
    }
  } else if (event.channel == channels::scan_data) {
    if (const auto m = decode<ScanPacket>(event.data)) scans_.take(*m);
  } else if (event.channel == channels::event) {
    if (const auto m = decode<event_t>(event.data)) {
      const Json json = {{"timestamp", time_of(m->utime)},
                         {"level", level_of(m->severity)},
                         {"message", m->code + ": " + m->text},
                         {"name", m->node},
                         {"file", ""},
                         {"line", 0}};
      out_(Topic::log, json_text(json));
    }
  }
}

void Foxglove::put_cloud(const ScanCloud& scan) {
  constexpr std::size_t stride = point_fields.size() * sizeof(float);
  std::string data(scan.points.size() * stride, '\0');
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const auto floats = floats_of(scan.points[i]);
    std::memcpy(data.data() + i * stride, floats.data(), stride);
  }
  Json fields = Json::array();
  int offset = 0;
  for (const char* name : point_fields) {
    fields.push_back({{"name", name}, {"offset", offset}, {"type", 7}});  // FLOAT32
    offset += 4;
  }
  const Json json = {
      {"timestamp", time_of(scan.utime)},
      {"frame_id", "sensor"},
      {"pose", {{"position", vector_of(0, 0, 0)}, {"orientation", quaternion_of(1, 0, 0, 0)}}},
      {"point_stride", stride},
      {"fields", fields},
      {"data", base64(data)}};
  out_(Topic::scan, json_text(json));
}

}  // namespace berth::logs
