// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/facility/plc_map.h"

#include <modbus/modbus.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/config.h"
#include "drivers/registers/unit.h"

namespace berth {
namespace {

constexpr double level_scale = 10000;
constexpr double angle_scale = 100;

PlcMap::Block read_block(Config config, int max_registers) {
  PlcMap::Block block;
  block.first = config.small_integer("first", at_least(1));
  block.count = config.small_integer("count", within(1, max_registers));
  config.finish();
  return block;
}

int read_register(Config& config, const std::string& key, const PlcMap::Block& block) {
  const auto n = config.small_integer(key);
  if (n < block.first || n - block.first >= block.count) {
    throw config.error(key, "register " + std::to_string(n) + " is outside its block");
  }
  return n;
}

int read_bit(Config& config, const std::string& key) {
  return config.small_integer(key, within(0, 15));
}

}  // namespace

PlcMap PlcMap::load(const std::filesystem::path& path) {
  Config config = Config::load(path);
  PlcMap map;
  map.unit = read_unit(config);
  map.status = read_block(config.section("status"), MODBUS_MAX_READ_REGISTERS);
  map.command = read_block(config.section("command"), MODBUS_MAX_WRITE_REGISTERS);
  map.safety = read_register(config, "safety", map.status);
  Config bits = config.section("bits");
  map.estop_bit = read_bit(bits, "estop_chain_closed");
  map.fence_bit = read_bit(bits, "fence_closed");
  map.motion_bit = read_bit(bits, "motion_enabled");
  bits.finish();
  const auto value = [&](const std::string& key) {
    Config section = config.section(key);
    const PlcMap::Value registers{read_register(section, "status", map.status),
                                  read_register(section, "command", map.command)};
    section.finish();
    return registers;
  };
  map.sun_lamp = value("sun_lamp");
  map.albedo_lamp = value("albedo_lamp");
  map.sun_azimuth = value("sun_azimuth");
  map.sun_elevation = value("sun_elevation");
  map.heartbeat = read_register(config, "heartbeat", map.status);
  config.finish();
  return map;
}

Word word_from_level(double level) {
  return static_cast<Word>(std::lround(level_scale * std::clamp(level, 0.0, 1.0)));
}

double level_from_word(Word word) { return word / level_scale; }

Word word_from_angle(double angle) {
  const long hundredths =
      std::lround(angle_scale * degrees(std::remainder(angle, 2 * std::numbers::pi)));
  return static_cast<Word>(static_cast<std::int16_t>(hundredths));
}

double angle_from_word(Word word) { return radians(static_cast<std::int16_t>(word) / angle_scale); }

}  // namespace berth
