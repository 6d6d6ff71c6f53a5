// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/lidar/simulated_lidar.h"

#include <algorithm>
#include <cmath>

#include "drivers/lidar/limits.h"

namespace berth {

SimulatedLidar::SimulatedLidar(const std::string& address, LidarProfile profile,
                               SimulatedLidarSettings settings, std::uint64_t seed, Loop& loop,
                               Wires& wires, Scene& scene)
    : profile_(std::move(profile)),
      settings_(std::move(settings)),
      random_(seed, "lidar"),
      sun_random_(seed, "lidar sun"),
      fault_random_(seed, "lidar faults"),
      loop_(loop),
      scene_(scene),
      started_(loop.now()) {
  wires.listen(address, [this](int fd) { accept(fd); });
}

SimulatedLidar::~SimulatedLidar() { loop_.cancel(packet_timer_); }

void SimulatedLidar::accept(int fd) {
  stop();
  greeted_ = false;
  connection_ = std::make_unique<lidar::Connection>(
      loop_, fd, [this](const lidar::Message& message) { receive(message); },
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
  if (hello.version != lidar::protocol_version) {
    send(lidar::Complaint{"this is version " + std::to_string(lidar::protocol_version) +
                          " of the protocol"});
    connection_.reset();
    return;
  }
  greeted_ = true;
  lidar::Identity identity;
  identity.model = profile_.model;
  identity.serial = settings_.serial;
  identity.rate_hz = profile_.rate_hz;
  identity.range_min_m = profile_.beam.range_min_m;
  identity.range_max_m = profile_.beam.range_max_m;
  identity.field_of_view_rad[0] = profile_.field_of_view_width;
  identity.field_of_view_rad[1] = profile_.field_of_view_height;
  identity.minimum_step_rad = profile_.minimum_step_rad;
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
  scan_->window_start = loop_.now() + settings_.start_delay;
  for (const lidar::Window& window : order.windows) {
    scan_->windows.emplace_back(window);
    answer.beams += static_cast<std::uint32_t>(scan_->windows.back().size());
  }
  send(answer);
  schedule_packet();
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
    scan_->window_start = fired_at(scan_->next) + settings_.window_delay;
    scan_->next = 0;
    if (++scan_->window == scan_->windows.size()) return end(lidar::ScanResult::complete);
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
  SceneHit hit;
  const bool met = scene_.cast(t, direction, beam.range_max_m, hit);
  double power = 0;
  if (met && hit.range < beam.range_min_m) {
    measured.status = lidar::BeamStatus::too_near;
  } else if (met) {
    // Received power of a diffuse surface that the beam fills.
    const double falloff = settings_.full_scale_range_m / hit.range;
    power = hit.reflectivity * std::cos(hit.incidence) * falloff * falloff;
    const double intensity = std::round(4095 * std::clamp(power, 0.0, 1.0));
    if (intensity >= settings_.least_intensity) {
      measured.status = lidar::BeamStatus::hit;
      measured.intensity = static_cast<std::uint16_t>(intensity);
      measured.range_m = static_cast<float>(std::max(hit.range + range_error, 0.0));
    }
  }
  if (sun.level > 0) {
    add_glare(measured, direction, sun, met ? &hit : nullptr, power, range_error);
  }
  add_faults(measured);
  return measured;
}

void SimulatedLidar::add_glare(lidar::BeamReturn& measured, const Vector3d& direction,
                               const Sunlight& sun, const SceneHit* hit, double power,
                               double range_error) {
  const double chance = sun_random_.uniform();
  const double where = sun_random_.uniform();
  const Glare glare =
      glare_of(settings_.sun, sun_background(settings_.sun, sun, direction, hit), power);
  if (chance < glare.early) {
    const double nearest = profile_.beam.range_min_m;
    const double farthest = hit != nullptr ? std::max(nearest, hit->range)
                                           : std::max(nearest, settings_.full_scale_range_m);
    measured.status = lidar::BeamStatus::hit;
    measured.intensity = 1;
    measured.range_m = static_cast<float>(nearest + where * (farthest - nearest));
  } else if (chance < glare.early + glare.lost) {
    measured.status = lidar::BeamStatus::miss;
    measured.intensity = 0;
    measured.range_m = 0;
  } else if (measured.status == lidar::BeamStatus::hit) {
    const double range = hit->range + glare.sigma_scale * range_error;
    measured.range_m = static_cast<float>(std::max(range, 0.0));
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

namespace {

void read_surfaces(Config& config, const std::string& key, SurfaceShares& shares) {
  if (!config.has(key)) return;
  Config part = config.section(key);
  const std::pair<const char*, double*> values[] = {{"target", &shares.target},
                                                    {"mount", &shares.mount},
                                                    {"arm", &shares.arm},
                                                    {"room", &shares.room}};
  for (const auto& [name, value] : values) {
    part.optional(name, *value);
    if (!(*value >= 0 && *value <= 1)) throw part.error(name, "expected 0 to 1");
  }
  part.finish();
}

}  // namespace

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
  time("window_delay", settings.window_delay);
  config.optional("beams_per_packet", settings.beams_per_packet);
  time("clock_offset", settings.clock_offset);
  config.optional("clock_drift", settings.clock_drift);
  config.optional("noise_scale", settings.noise_scale);
  config.optional("full_scale_range", Dimension::length, settings.full_scale_range_m);
  config.optional("least_intensity", settings.least_intensity);
  if (settings.start_delay < 0) throw config.error("start_delay", "must not be negative");
  if (settings.window_delay < 0) throw config.error("window_delay", "must not be negative");
  if (settings.beams_per_packet < 1 ||
      settings.beams_per_packet > static_cast<int>(lidar::max_beams_per_message)) {
    throw config.error("beams_per_packet", "expected 1 to 3000");
  }
  if (std::abs(settings.clock_drift) > 1e-3) {
    throw config.error("clock_drift", "expected at most 0.001");
  }
  if (settings.noise_scale < 0) throw config.error("noise_scale", "must not be negative");
  read_surfaces(config, "reflectivity", settings.scene.reflectivity);
  read_surfaces(config, "specular", settings.scene.specular);
  if (config.has("sun")) settings.sun = read_sun_glare(config.section("sun"));
  config.finish();
  return settings;
}

}  // namespace berth
