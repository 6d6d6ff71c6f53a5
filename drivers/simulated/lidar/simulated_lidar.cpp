// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/lidar/simulated_lidar.h"

#include <algorithm>
#include <cmath>

#include "common/core/config.h"
#include "drivers/lidar/limits.h"

namespace berth {
namespace {

constexpr double full_scale = 4095;

std::uint16_t intensity_of(double power) {
  return static_cast<std::uint16_t>(std::round(full_scale * std::min(power, 1.0)));
}

}  // namespace

SimulatedLidar::SimulatedLidar(const std::string& address, LidarProfile profile,
                               SimulatedLidarSettings settings, std::uint64_t seed, Loop& loop,
                               Scene& scene)
    : profile_(std::move(profile)),
      settings_(std::move(settings)),
      receiver_(profile_.beam, settings_.receiver, seed),
      fault_random_(seed, "lidar faults"),
      loop_(loop),
      scene_(scene),
      started_(loop.now()) {
  settings_.beams_per_packet = lidar::packet_size(profile_, settings_.beams_per_packet);
  lidar::listen(loop_, address, [this](std::unique_ptr<lidar::Connection> connection) {
    accept(std::move(connection));
  });
}

SimulatedLidar::~SimulatedLidar() { loop_.cancel(packet_timer_); }

void SimulatedLidar::accept(std::unique_ptr<lidar::Connection> connection) {
  stop();
  greeted_ = false;
  connection_ = std::move(connection);
  connection_->open([this](const lidar::Message& message) { receive(message); },
                    [this](const std::string& reason) {
                      send(lidar::Complaint{reason});
                      stop();
                      connection_.reset();
                    });
}

void SimulatedLidar::send(const lidar::Message& message) {
  if (connection_ && !faults_.silent) connection_->send(message);
}

void SimulatedLidar::receive(const lidar::Message& message) {
  if (const auto* hello = std::get_if<lidar::Hello>(&message)) return greet(*hello);
  if (!greeted_) {
    send(lidar::Complaint{"the first message must be Hello"});
  } else if (const auto* order = std::get_if<lidar::ScanOrder>(&message)) {
    return take_order(*order);
  } else if (const auto* cancel = std::get_if<lidar::Cancel>(&message)) {
    if (scanning() && scan_->id == cancel->scan_id) end(lidar::ScanResult::cancelled);
    return;
  } else if (const auto* query = std::get_if<lidar::StatusQuery>(&message)) {
    return answer_status(query->token);
  } else {
    send(lidar::Complaint{"a message that only the device sends"});
  }
  stop();
  connection_.reset();
}

void SimulatedLidar::greet(const lidar::Hello& hello) {
  if (hello.version < 1) {
    send(lidar::Complaint{"this is version " + std::to_string(lidar::protocol_version) +
                          " of the protocol"});
    connection_.reset();
    return;
  }
  greeted_ = true;
  lidar::Identity identity = lidar::identity_of(profile_, settings_.serial);
  identity.version = std::min(hello.version, lidar::protocol_version);
  connection_->speak(identity.version);
  send(identity);
}

void SimulatedLidar::take_order(const lidar::ScanOrder& order) {
  lidar::ScanAnswer answer;
  answer.scan_id = order.scan_id;
  answer.reason = scanning() ? "scan " + std::to_string(scan_->id) + " is running"
                             : lidar::check_windows(profile_, order.windows);
  answer.accepted = answer.reason.empty();
  if (!answer.accepted) return send(answer);

  scan_ = Scan();
  scan_->id = order.scan_id;
  scan_->rate_hz = profile_.rate_hz * faults_.speed;
  for (const Window& window : order.windows) {
    scan_->windows.emplace_back(window);
    answer.beams += static_cast<std::uint32_t>(scan_->windows.back().size());
  }
  send(answer);
  aim_at_window(loop_.now() + settings_.start_delay);
  schedule_packet();
}

/// From where the mirror is to the first beam of the next window.
void SimulatedLidar::aim_at_window(Utime from) {
  const lidar::BeamAngles first = scan_->windows[scan_->window].beam(0);
  const double angle = std::hypot(first.azimuth - aim_.azimuth, first.elevation - aim_.elevation);
  scan_->window_start = from + slew_time(settings_.mirror, angle);
}

void SimulatedLidar::answer_status(std::uint32_t token) {
  lidar::Status status;
  status.token = token;
  status.device_time = device_time(loop_.now());
  status.state = scanning() ? lidar::DeviceState::scanning : lidar::DeviceState::idle;
  if (scan_) {
    status.scan_id = scan_->id;
    status.beams_done = scan_->beams;
  }
  send(status);
}

Utime SimulatedLidar::fired_at(std::int64_t beam) const {
  return scan_->window_start + std::llround(static_cast<double>(beam) * 1e6 / scan_->rate_hz);
}

std::int64_t SimulatedLidar::device_time(Utime t) const {
  return t + settings_.clock_offset +
         std::llround(settings_.clock_drift * static_cast<double>(t - started_));
}

void SimulatedLidar::schedule_packet() {
  const std::int64_t left = scan_->windows[scan_->window].size() - scan_->next;
  const std::int64_t last = scan_->next + std::min<std::int64_t>(left, settings_.beams_per_packet);
  packet_timer_ = loop_.at(fired_at(last - 1), [this] { measure_packet(); });
}

void SimulatedLidar::measure_packet() {
  const lidar::ScanPattern& pattern = scan_->windows[scan_->window];
  const std::int64_t last = std::min(pattern.size(), scan_->next + settings_.beams_per_packet);
  const Utime first_fired = fired_at(scan_->next);
  packet_.scan_id = scan_->id;
  packet_.window = static_cast<std::uint16_t>(scan_->window);
  packet_.beams_before = scan_->beams;
  packet_.device_time = device_time(first_fired);
  packet_.beams.clear();
  scene_.prepare(fired_at(last - 1));
  const Sunlight sun = scene_.sunlight(first_fired);
  for (; scan_->next < last; ++scan_->next) {
    const Utime fired = fired_at(scan_->next);
    packet_.beams.push_back(measure(pattern.beam(scan_->next), fired, sun));
    packet_.beams.back().after_us =
        static_cast<std::uint32_t>(device_time(fired) - packet_.device_time);
  }
  scan_->beams += static_cast<std::uint32_t>(packet_.beams.size());
  send(packet_);

  if (scan_->next == pattern.size()) {
    const Utime over = fired_at(scan_->next);
    aim_ = pattern.beam(pattern.size() - 1);
    scan_->next = 0;
    if (++scan_->window == scan_->windows.size()) return end(lidar::ScanResult::complete);
    aim_at_window(over);
  }
  schedule_packet();
}

lidar::BeamReturn SimulatedLidar::measure(const lidar::BeamAngles& angles, Utime t,
                                          const Sunlight& sun) {
  receiver_.range_noise = faults_.noise_scale * faults_.range_noise;
  receiver_.angle_noise = faults_.noise_scale * faults_.angle_noise;
  const Received received = receiver_.measure(scene_, t, angles.azimuth, angles.elevation, sun);
  ++beams_fired_;

  lidar::BeamReturn measured;
  measured.azimuth_rad = static_cast<float>(angles.azimuth);
  measured.elevation_rad = static_cast<float>(angles.elevation);
  measured.status = received.status;
  measured.intensity = intensity_of(received.power);
  measured.range_m = static_cast<float>(received.range);
  measured.ambient = static_cast<float>(full_scale * received.background);
  measured.range2_m = static_cast<float>(received.second_range);
  measured.intensity2 = intensity_of(received.second_power);
  add_faults(measured);
  const auto sigma = static_cast<float>(received.range_sigma);
  if (measured.range_m > 0) measured.range_sigma_m = sigma;
  if (measured.range2_m > 0) measured.range2_sigma_m = sigma;
  return measured;
}

void SimulatedLidar::add_faults(lidar::BeamReturn& measured) {
  const bool lost = faults_.dropout > 0 && fault_random_.uniform() < faults_.dropout;
  if (faults_.blackout || lost) {
    measured.status = BeamStatus::miss;
    measured.intensity = measured.intensity2 = 0;
    measured.range_m = measured.range2_m = 0;
  } else if (measured.status == BeamStatus::hit && faults_.range_bias != 0) {
    for (float* range : {&measured.range_m, &measured.range2_m}) {
      if (*range == 0) continue;
      *range = static_cast<float>(std::max(double{*range} + faults_.range_bias, 0.0));
    }
  }
}

void SimulatedLidar::end(lidar::ScanResult result) {
  loop_.cancel(packet_timer_);
  scan_->over = true;
  lidar::ScanEnd message;
  message.scan_id = scan_->id;
  message.result = result;
  message.beams = scan_->beams;
  message.device_time = device_time(loop_.now());
  send(message);
}

void SimulatedLidar::stop() {
  loop_.cancel(packet_timer_);
  if (scan_) scan_->over = true;
}

SimulatedLidarSettings load_simulated_lidar(const std::filesystem::path& file) {
  Config config = Config::load(file);
  SimulatedLidarSettings settings;
  config.optional("serial", settings.serial);
  config.optional_microseconds("start_delay", settings.start_delay, at_least(0));
  config.optional("beams_per_packet", settings.beams_per_packet,
                  within(1, lidar::max_beams_per_message));
  config.optional_microseconds("clock_offset", settings.clock_offset);
  config.optional("clock_drift", settings.clock_drift, within(-1e-3, 1e-3));
  ReceiverSettings& receiver = settings.receiver;
  config.optional("noise_scale", receiver.noise_scale, at_least(0));
  config.optional("full_scale_range", Dimension::length, receiver.echoes.full_scale_range_m);
  int min_intensity = 0;
  config.optional("min_intensity", min_intensity);
  receiver.min_power = (min_intensity - 0.5) / full_scale;
  config.optional("saturation", receiver.saturation, above(0));
  settings.mirror = read_mirror(config.optional_section("mirror"));
  read_scene_settings(config, settings.scene);
  receiver.sun = read_sun_glare(config.optional_section("sun"));
  config.finish();
  return settings;
}

}  // namespace berth
