// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/lidar/simulated_lidar.h"

#include <algorithm>
#include <cmath>

#include "common/core/positive.h"
#include "drivers/lidar/identity.h"
#include "drivers/lidar/limits.h"

namespace berth {
namespace {

constexpr double full_scale = 4095;

}  // namespace

SimulatedLidar::SimulatedLidar(const std::string& address, LidarProfile profile,
                               SimulatedLidarSettings settings, std::uint64_t seed, Loop& loop,
                               Scene& scene)
    : profile_(std::move(profile)),
      settings_(std::move(settings)),
      random_(seed, "lidar"),
      glitter_random_(seed, "lidar glitter"),
      sun_random_(seed, "lidar sun"),
      fault_random_(seed, "lidar faults"),
      loop_(loop),
      scene_(scene),
      started_(loop.now()) {
  settings_.beams_per_packet = lidar::packet_size(profile_, settings_.beams_per_packet);
  const double falloff = settings_.receiver.full_scale_range_m / profile_.beam.range_max_m;
  least_power_ = std::max(settings_.receiver.range_max_reflectivity * falloff * falloff,
                          (settings_.least_intensity - 0.5) / full_scale);
  loop_.wires().listen(address, [this](std::unique_ptr<Wire> wire) { accept(std::move(wire)); });
}

SimulatedLidar::~SimulatedLidar() { loop_.cancel(packet_timer_); }

void SimulatedLidar::accept(std::unique_ptr<Wire> wire) {
  stop();
  greeted_ = false;
  connection_ = std::make_unique<lidar::Connection>(
      loop_, std::move(wire), [this](const lidar::Message& message) { receive(message); },
      [this](const std::string&) {
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
  for (const lidar::Window& window : order.windows) {
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
  const BeamModel& beam = profile_.beam;
  const double scale = settings_.noise_scale * faults_.noise_scale;
  const double angle_scale = scale * faults_.angle_noise;
  const double azimuth = angles.azimuth + random_.normal(angle_scale * beam.azimuth_sigma_rad);
  const double elevation =
      angles.elevation + random_.normal(angle_scale * beam.elevation_sigma_rad);
  const double range_error = random_.normal(scale * faults_.range_noise * beam.range_sigma_m);
  ++beams_fired_;

  lidar::BeamReturn measured;
  measured.azimuth_rad = static_cast<float>(angles.azimuth);
  measured.elevation_rad = static_cast<float>(angles.elevation);
  const Vector3d direction = beam_direction(azimuth, elevation);
  const std::optional<Echo> echo = echo_of(direction, t);
  if (echo && echo->range < beam.range_min_m) {
    measured.status = lidar::BeamStatus::too_near;
  } else if (echo && echo->power >= least_power_) {
    const double distance = echo->range / settings_.receiver.full_scale_range_m;
    const bool dazzles = echo->power * distance * distance > settings_.saturation;
    measured.status = dazzles ? lidar::BeamStatus::saturated : lidar::BeamStatus::hit;
    measured.intensity =
        static_cast<std::uint16_t>(std::round(full_scale * std::min(echo->power, 1.0)));
    if (!dazzles) measured.range_m = static_cast<float>(std::max(echo->range + range_error, 0.0));
  }
  measured.range_sigma_m = static_cast<float>(beam.range_sigma_m);
  if (!sun.dark()) add_glare(measured, direction, sun, echo, range_error);
  add_faults(measured);
  if (measured.status != lidar::BeamStatus::hit) measured.range_sigma_m = 0;
  return measured;
}

std::optional<Echo> SimulatedLidar::echo_of(const Vector3d& direction, Utime t) {
  const BeamModel& beam = profile_.beam;
  if (settings_.mixed_pixels && beam.footprint(1) > 0) {
    const auto rays = rays_of_beam(direction, beam);
    std::array<SceneHit, rays_per_beam> hits;
    scene_.cast(t, rays, beam.range_max_m, hits);
    return received_echo(settings_.receiver, hits, glitter_random_);
  }
  SceneHit hit;
  scene_.cast(t, direction, beam.range_max_m, hit);
  return received_echo(settings_.receiver, {&hit, 1}, glitter_random_);
}

void SimulatedLidar::add_glare(lidar::BeamReturn& measured, const Vector3d& direction,
                               const Sunlight& sun, const std::optional<Echo>& echo,
                               double range_error) {
  const double chance = sun_random_.uniform();
  const double where = sun_random_.uniform();
  const SceneHit* hit = echo ? &echo->hit : nullptr;
  const double background = sun_background(settings_.sun, sun, direction, hit);
  const Glare glare = glare_of(settings_.sun, background, echo ? echo->power : 0);
  measured.ambient = static_cast<float>(full_scale * background);
  measured.range_sigma_m = static_cast<float>(profile_.beam.range_sigma_m * glare.sigma_scale);
  if (chance < glare.early) {
    const double nearest = profile_.beam.range_min_m;
    const double farthest = echo ? std::max(nearest, echo->range) : profile_.beam.range_max_m;
    measured.status = lidar::BeamStatus::hit;
    measured.range_m = static_cast<float>(nearest + where * (farthest - nearest));
    measured.intensity = 0;
  } else if (chance < glare.early + glare.lost) {
    measured.status = lidar::BeamStatus::miss;
    measured.range_m = 0;
    measured.intensity = 0;
  } else if (measured.status == lidar::BeamStatus::hit) {
    const double noisy = echo->range + range_error * glare.sigma_scale;
    measured.range_m = static_cast<float>(std::max(noisy, 0.0));
  }
}

void SimulatedLidar::add_faults(lidar::BeamReturn& measured) {
  const bool lost = faults_.dropout > 0 && fault_random_.uniform() < faults_.dropout;
  if (faults_.blackout || lost) {
    measured.status = lidar::BeamStatus::miss;
    measured.intensity = 0;
    measured.range_m = 0;
  } else if (const double bias = settings_.range_bias + faults_.range_bias;
             measured.status == lidar::BeamStatus::hit && bias != 0) {
    const double range = double{measured.range_m} + bias;
    measured.range_m = static_cast<float>(std::max(range, 0.0));
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
  const auto time = [&config](const std::string& key, Utime& value) {
    double s = seconds(value);
    config.optional(key, Dimension::time, s);
    value = utime_from_seconds(s);
  };
  config.optional("serial", settings.serial);
  time("start_delay", settings.start_delay);
  config.optional("beams_per_packet", settings.beams_per_packet);
  time("clock_offset", settings.clock_offset);
  config.optional("clock_drift", settings.clock_drift);
  config.optional("noise_scale", settings.noise_scale);
  config.optional("full_scale_range", Dimension::length, settings.receiver.full_scale_range_m);
  config.optional("least_intensity", settings.least_intensity);
  expect_not_negative(config, "start_delay", settings.start_delay);
  if (settings.beams_per_packet < 1 ||
      settings.beams_per_packet > static_cast<int>(lidar::max_beams_per_message)) {
    throw config.error("beams_per_packet",
                       "expected 1 to " + std::to_string(lidar::max_beams_per_message));
  }
  if (std::abs(settings.clock_drift) > 1e-3) {
    throw config.error("clock_drift", "expected at most 0.001");
  }
  expect_not_negative(config, "noise_scale", settings.noise_scale);
  config.optional("mixed_pixels", settings.mixed_pixels);
  config.optional("least_echo", settings.receiver.least_echo);
  if (!(settings.receiver.least_echo >= 0 && settings.receiver.least_echo <= 1)) {
    throw config.error("least_echo", "expected 0 to 1");
  }
  config.optional("saturation", settings.saturation);
  if (!(settings.saturation > 0)) throw config.error("saturation", "must be greater than zero");
  if (config.has("mirror")) settings.mirror = read_mirror(config.section("mirror"));
  read_scene_settings(config, settings.scene);
  if (config.has("sun")) settings.sun = read_sun_glare(config.section("sun"));
  config.finish();
  return settings;
}

}  // namespace berth
