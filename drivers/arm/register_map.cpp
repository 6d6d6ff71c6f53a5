// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/register_map.h"

#include <modbus/modbus.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>

#include "common/core/config.h"
#include "drivers/registers/unit.h"

namespace berth {

int element_words(SnpxVariable::Kind kind) {
  switch (kind) {
    case SnpxVariable::Kind::position:
    case SnpxVariable::Kind::position_register:
      return position_words::count;
    case SnpxVariable::Kind::program:
      return program_words::count;
    case SnpxVariable::Kind::alarm:
      return alarm_words::count;
    case SnpxVariable::Kind::number:
    case SnpxVariable::Kind::system:
      break;
  }
  return 2;
}

std::optional<SnpxVariable> parse_snpx_variable(const std::string& text) {
  SnpxVariable variable;
  if (!text.empty() && text.front() == '$') {
    variable.kind = SnpxVariable::Kind::system;
    variable.name = text;
    return variable;
  }
  static const std::regex grammar(
      R"((R|POS|PR|PRG|ALM)\[(?:G1:)?([0-9]{1,5})\](?:@([0-9]{1,3})\.([0-9]{1,3}))?)");
  std::smatch match;
  if (!std::regex_match(text, match, grammar)) return std::nullopt;
  using Kind = SnpxVariable::Kind;
  const std::string kind = match[1];
  variable.kind = kind == "R"     ? Kind::number
                  : kind == "POS" ? Kind::position
                  : kind == "PR"  ? Kind::position_register
                  : kind == "PRG" ? Kind::program
                                  : Kind::alarm;
  variable.index = std::stoi(match[2]);
  variable.words = element_words(variable.kind);
  if (match[3].matched) {
    variable.first_word = std::stoi(match[3]);
    const int words = std::stoi(match[4]);
    if (variable.first_word < 1 || words < 1 || variable.first_word + words - 1 > variable.words) {
      return std::nullopt;
    }
    variable.words = words;
  }
  return variable;
}

namespace {

constexpr int last_register = 16384;
constexpr int max_name = 37;

SnpxAssignment read_assignment(Config config) {
  SnpxAssignment a;
  a.slot = config.small_integer("slot", within(1, 80));
  a.address = config.small_integer("address", at_least(1));
  a.size = config.small_integer("size", at_least(1));
  a.variable = config.text("variable");
  a.multiply = config.small_integer("multiply");
  config.finish();
  if (a.address > last_register - a.size + 1) {
    throw config.error("address", "expected registers within 1 to 16384");
  }
  if (!parse_snpx_variable(a.variable) || a.variable.size() > max_name ||
      a.variable.find(' ') != std::string::npos) {
    throw config.error("variable", "found '" + a.variable +
                                       "', expected R[n], PR[n], POS[n], PRG[n], ALM[n] or $name, "
                                       "perhaps with @a.b, of at most 37 characters");
  }
  return a;
}

RegisterBlock read_block(Config config, int max_registers) {
  RegisterBlock block;
  block.first = config.small_integer("first", at_least(1));
  block.count = config.small_integer("count", within(1, max_registers));
  config.finish();
  return block;
}

/// Finds variables in the assignments; its errors name the file's keys.
class Locator {
 public:
  Locator(const std::vector<SnpxAssignment>& assignments) : assignments_(assignments) {}

  int word(Config& config, const std::string& key, int word, const RegisterBlock& block) {
    return find(config, key, word, 1, block).address;
  }

  RegisterField number(Config& config, const std::string& key, const RegisterBlock& block) {
    const VariableLocation at = find(config, key, 1, 2, block);
    RegisterField field;
    field.address = at.address;
    field.form = at.multiply == 0 ? RegisterField::Form::float32 : RegisterField::Form::int32;
    field.multiply = at.multiply == 0 ? 1 : at.multiply;
    return field;
  }

  VariableLocation find(Config& config, const std::string& key, int word, int words,
                        const RegisterBlock& block) {
    const std::string text = config.text(key);
    const auto variable = parse_snpx_variable(text);
    const auto at = variable ? locate(assignments_, *variable, word) : std::nullopt;
    if (!at) throw config.error(key, "'" + text + "' is in none of the assignments");
    if (!block.contains(at->address, words)) {
      throw config.error(key, "'" + text + "' stands at register " + std::to_string(at->address) +
                                  ", outside its block");
    }
    return *at;
  }

 private:
  const std::vector<SnpxAssignment>& assignments_;
};

}  // namespace

double RegisterField::get(const Word* two) const {
  return form == Form::float32 ? static_cast<double>(get_float(two)) : get_int32(two) / multiply;
}

void RegisterField::put(double value, Word* two) const {
  if (form == Form::float32) {
    put_float(static_cast<float>(value), two);
  } else {
    put_int32(static_cast<std::int32_t>(std::llround(value * multiply)), two);
  }
}

std::optional<VariableLocation> locate(const std::vector<SnpxAssignment>& assignments,
                                       const SnpxVariable& variable, int word) {
  for (const SnpxAssignment& a : assignments) {
    const auto shown = parse_snpx_variable(a.variable);
    if (!shown || shown->kind != variable.kind || shown->name != variable.name) continue;
    const int element = variable.index - shown->index;
    const int within = word - shown->first_word;
    const int offset = element * shown->words + within;
    if (element >= 0 && within >= 0 && within < shown->words && offset < a.size) {
      return VariableLocation{a.address + offset, a.multiply};
    }
  }
  return std::nullopt;
}

RegisterMap RegisterMap::load(const std::filesystem::path& path) {
  Config config = Config::load(path);
  RegisterMap map;
  map.unit = read_unit(config);

  std::set<int> slots;
  for (Config& section : config.sections("assignments")) {
    map.assignments.push_back(read_assignment(section));
    if (!slots.insert(map.assignments.back().slot).second) {
      throw section.error("slot", "is used twice");
    }
  }
  std::sort(map.assignments.begin(), map.assignments.end(),
            [](const auto& a, const auto& b) { return a.slot < b.slot; });
  map.status = read_block(config.section("status"), MODBUS_MAX_READ_REGISTERS);
  map.command = read_block(config.section("command"), MODBUS_MAX_WRITE_REGISTERS);

  if (config.has("bootstrap")) {
    Config section = config.optional_section("bootstrap");
    Bootstrap window;
    window.first = section.small_integer("first");
    window.peephole = section.small_integer("peephole");
    section.finish();
    map.bootstrap = window;
  }

  Locator locator(map.assignments);
  const auto position = locator.find(config, "position", 1, position_words::tool, map.status);
  map.position = position.address;
  if (position.multiply != 0) throw config.error("position", "expected multiply 0 (float32)");
  const auto joints = locator.find(config, "setpoint", position_words::joints, 12, map.command);
  if (joints.multiply != 0) throw config.error("setpoint", "expected multiply 0 (float32)");
  map.setpoint_joints = joints.address;
  map.setpoint_valid = locator.word(config, "setpoint", position_words::joints_valid, map.command);
  map.program_state = locator.word(config, "program", program_words::state, map.status);

  std::string variable;
  config.optional("alarm", variable);
  if (config.has("alarm")) {
    const RegisterBlock all{1, last_register};
    const auto alarm = locator.find(config, "alarm", 1, alarm_words::text_end, all);
    if (alarm.multiply != -1) throw config.error("alarm", "expected multiply -1 (text)");
    map.alarm = alarm.address;
    locator.find(config, "alarm", alarm_words::text_end, 1, all);  // shown as far as its text
  }

  Config numbers = config.section("numbers");
  map.tick = locator.number(numbers, "tick", map.status);
  map.heartbeat = locator.number(numbers, "heartbeat", map.status);
  map.setpoint_taken = locator.number(numbers, "setpoint_taken", map.status);
  map.state = locator.number(numbers, "state", map.status);
  map.speed_override = locator.number(numbers, "override", map.status);
  map.tcp_speed = locator.number(numbers, "tcp_speed", map.status);
  map.error = locator.number(numbers, "error", map.status);
  map.setpoint_sequence = locator.number(numbers, "setpoint_sequence", map.command);
  map.command_word = locator.number(numbers, "command", map.command);
  map.host_heartbeat = locator.number(numbers, "host_heartbeat", map.command);
  map.speed_limit = locator.number(numbers, "speed_limit", map.command);
  map.setpoint_time = locator.number(numbers, "setpoint_time", map.command);
  map.mode = locator.number(numbers, "mode", map.command);
  numbers.finish();

  map.tick_period = config.microseconds("tick_period");
  map.counter_wrap = config.small_integer("counter_wrap", at_least(1 << 16));
  Config coils = config.section("coils");
  map.start_coil = coils.small_integer("start");
  map.hold_coil = coils.small_integer("hold");
  map.reset_coil = coils.small_integer("reset");
  coils.finish();
  map.pulse = config.microseconds("pulse");
  config.finish();
  return map;
}

std::string RegisterMap::assignment_table() const {
  std::string table;
  for (const SnpxAssignment& a : assignments) {
    const std::string entry = "$SNPX_ASG[" + std::to_string(a.slot) + "].";
    table += entry + "$ADDRESS = " + std::to_string(a.address) + "\n";
    table += entry + "$SIZE = " + std::to_string(a.size) + "\n";
    table += entry + "$VAR_NAME = '" + a.variable + "'\n";
    table += entry + "$MULTIPLY = " + std::to_string(a.multiply) + "\n";
  }
  return table;
}

double pendant_from_si(double value, bool linear) { return linear ? 1000 * value : degrees(value); }

double si_from_pendant(double value, bool linear) { return linear ? value / 1000 : radians(value); }

std::array<bool, 6> linear_axes(const ArmKinematics& kinematics) {
  std::array<bool, 6> linear{};
  for (std::size_t i = 0; i < 6; ++i) linear[i] = kinematics.is_linear(static_cast<int>(i));
  return linear;
}

ArmReport ArmRegisterCodec::decode(std::span<const Word> words, int& tick_ms) const {
  const auto at = [&](int address) { return words.data() + (address - map_.status.first); };
  const auto number = [&](const RegisterField& field) { return field.get(at(field.address)); };
  const auto whole = [&](const RegisterField& field) {
    return static_cast<int>(std::lround(number(field)));
  };
  ArmReport report;
  report.valid = *at(map_.position + position_words::joints_valid - 1) == 1;
  for (std::size_t i = 0; i < 6; ++i) {
    const int address = map_.position + position_words::joints - 1 + 2 * static_cast<int>(i);
    const double value = static_cast<double>(get_float(at(address)));
    report.joints[i] = si_from_pendant(value, linear_[i]);
    if (!std::isfinite(value)) report.valid = false;
  }
  // With another tool than the flange selected, the controller reports the tool's point.
  const auto element = [&](int word) { return at(map_.position + word - 1); };
  if (*element(position_words::cartesian_valid) == 1 && *element(position_words::tool) == 0) {
    Vector3d flange;
    for (int i = 0; i < 3; ++i) {
      flange[i] = double{get_float(element(position_words::cartesian + 2 * i))} / 1000;
    }
    report.flange = flange;
  }
  tick_ms = whole(map_.tick);
  report.heartbeat = whole(map_.heartbeat);
  report.setpoint_taken = whole(map_.setpoint_taken);
  report.state = whole(map_.state);
  report.error = whole(map_.error);
  report.program_state = *at(map_.program_state);
  report.speed_override = number(map_.speed_override) / 100;
  report.tcp_speed = number(map_.tcp_speed) / 1000;
  return report;
}

std::span<const Word> ArmRegisterCodec::encode(const ArmOrder& order, int host_heartbeat) {
  block_.assign(static_cast<std::size_t>(map_.command.count), 0);
  const auto at = [&](int address) { return block_.data() + (address - map_.command.first); };
  for (std::size_t i = 0; i < 6; ++i) {
    put_float(static_cast<float>(pendant_from_si(order.joints[i], linear_[i])),
              at(map_.setpoint_joints + 2 * static_cast<int>(i)));
  }
  *at(map_.setpoint_valid) = 1;
  const auto put = [&](const RegisterField& field, double value) {
    field.put(value, at(field.address));
  };
  put(map_.setpoint_sequence, order.sequence);
  put(map_.command_word, order.follow ? 1 : 0);
  put(map_.host_heartbeat, host_heartbeat);
  put(map_.speed_limit, 100 * order.speed_limit);
  put(map_.setpoint_time, static_cast<double>(order.time / millisecond % map_.counter_wrap));
  put(map_.mode, 1);
  return block_;
}

}  // namespace berth
