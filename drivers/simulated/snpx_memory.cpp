// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/snpx_memory.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace berth {
namespace {

constexpr std::int64_t max_registers = 65536;  // that Modbus can name

void put_number(double value, int multiply, Word* two) {
  if (multiply == 0) {
    put_float(static_cast<float>(value), two);
  } else {
    put_int32(static_cast<std::int32_t>(std::llround(value * multiply)), two);
  }
}

double get_number(const Word* two, int multiply) {
  return multiply == 0 ? static_cast<double>(get_float(two))
                       : static_cast<double>(get_int32(two)) / multiply;
}

/// "$SNPX_ASG[7].$SIZE" -> 7 and "$SIZE".
bool parse_table_field(const std::string& name, int& slot, std::string& field) {
  char text[16] = "";
  if (std::sscanf(name.c_str(), "$SNPX_ASG[%d].%15s", &slot, text) != 2) return false;
  field = text;
  return slot >= 1 && slot <= 80;
}

}  // namespace

SnpxMemory::SnpxMemory(const std::vector<SnpxAssignment>& assignments) {
  for (const SnpxAssignment& a : assignments) assign(a);
}

void SnpxMemory::assign(const SnpxAssignment& assignment) {
  const auto variable = parse_snpx_variable(assignment.variable);
  // An entry that names nothing shows nothing.
  Slot slot{assignment, variable.value_or(SnpxVariable{SnpxVariable::Kind::system, 0, 1, 2, "$"})};
  slots_[assignment.slot] = slot;
  find_owners();
}

const SnpxAssignment* SnpxMemory::assignment(int slot) const {
  const auto found = slots_.find(slot);
  return found == slots_.end() ? nullptr : &found->second.assignment;
}

void SnpxMemory::find_owners() {
  owners_.clear();
  for (auto it = slots_.rbegin(); it != slots_.rend();
       ++it) {  // a lower slot comes before a higher
    const SnpxAssignment& a = it->second.assignment;
    const std::int64_t end = std::min(std::int64_t{a.address} + a.size, max_registers);
    for (std::int64_t address = std::max(a.address, 0); address < end; ++address) {
      const auto at = static_cast<std::size_t>(address);
      if (at >= owners_.size()) owners_.resize(at + 1, nullptr);
      owners_[at] = &it->second;
    }
  }
}

const SnpxMemory::Slot* SnpxMemory::owner(int address) const {
  const auto at = static_cast<std::size_t>(address);  // a negative one is beyond all
  return at < owners_.size() ? owners_[at] : nullptr;
}

int SnpxMemory::element_size(const Slot& slot) const {
  if (slot.variable.kind == SnpxVariable::Kind::system) return slot.assignment.size;
  return element_words(slot.variable.kind);
}

void SnpxMemory::read(int first, std::span<Word> words) const {
  std::fill(words.begin(), words.end(), Word{0});
  const int last = first + static_cast<int>(words.size()) - 1;
  for (auto it = slots_.rbegin(); it != slots_.rend();
       ++it) {  // lower slots write over higher ones
    const Slot& slot = it->second;
    const SnpxAssignment& a = slot.assignment;
    const int from = std::max(first, a.address);
    const int to = std::min(last, a.address + a.size - 1);
    const bool system = slot.variable.kind == SnpxVariable::Kind::system;
    const int shown = system ? a.size : slot.variable.words;  // words of each element
    for (int address = from; address <= to;) {
      const int offset = address - a.address;
      const int element = offset / shown;
      element_.assign(static_cast<std::size_t>(element_size(slot)), 0);
      encode(slot, slot.variable.index + element, element_);
      const int word = (system ? 0 : slot.variable.first_word - 1) + offset % shown;
      const int count = std::min(shown - offset % shown, to + 1 - address);
      std::copy_n(element_.begin() + word, count, words.begin() + (address - first));
      address += count;
    }
  }
}

void SnpxMemory::write(int first, std::span<const Word> words) {
  const int end = first + static_cast<int>(words.size());
  for (int address = first; address < end;) {
    const Slot* owned = owner(address);
    if (owned == nullptr) {
      ++address;
      continue;
    }
    const Slot slot = *owned;  // a write may change the table
    const SnpxAssignment& a = slot.assignment;
    const bool system = slot.variable.kind == SnpxVariable::Kind::system;
    const int shown = system ? a.size : slot.variable.words;
    const int element = (address - a.address) / shown;
    std::vector<Word> whole(static_cast<std::size_t>(element_size(slot)), 0);
    encode(slot, slot.variable.index + element, whole);
    // Words of this element that were written, and that this slot owns.
    const int element_end = std::min({a.address + (element + 1) * shown, a.address + a.size, end});
    for (; address < element_end && owner(address) == owned; ++address) {
      const int word = (system ? 0 : slot.variable.first_word - 1) + (address - a.address) % shown;
      whole[static_cast<std::size_t>(word)] = words[static_cast<std::size_t>(address - first)];
    }
    decode(slot, slot.variable.index + element, whole);
  }
}

void SnpxMemory::encode(const Slot& slot, int index, std::span<Word> words) const {
  using Kind = SnpxVariable::Kind;
  const int multiply = slot.assignment.multiply;
  const auto at = static_cast<std::size_t>(index);
  switch (slot.variable.kind) {
    case Kind::number:
      if (at < numbers.size()) put_number(numbers[at], multiply, words.data());
      return;
    case Kind::position:
      return encode_position(position, multiply, words);
    case Kind::position_register:
      if (at < position_registers.size()) {
        encode_position(position_registers[at], multiply, words);
      }
      return;
    case Kind::program:
      put_text(program_name, words.subspan(program_words::name - 1, 8));
      words[program_words::line - 1] = static_cast<Word>(program_line);
      words[program_words::state - 1] = static_cast<Word>(program_state);
      return;
    case Kind::alarm:
      if (alarm_number == 0) return;
      words[alarm_words::id - 1] = 1;
      words[alarm_words::number - 1] = static_cast<Word>(alarm_number);
      words[alarm_words::severity - 1] = 2;
      put_text(alarm_text, words.subspan(alarm_words::text - 1, alarm_words::text_words));
      return;
    case Kind::system:
      return encode_system(slot, words);
  }
}

void SnpxMemory::decode(const Slot& slot, int index, std::span<const Word> words) {
  using Kind = SnpxVariable::Kind;
  const auto at = static_cast<std::size_t>(index);
  switch (slot.variable.kind) {
    case Kind::number:
      if (at < numbers.size()) numbers[at] = get_number(words.data(), slot.assignment.multiply);
      return;
    case Kind::position_register:
      if (at < position_registers.size()) {
        decode_position(position_registers[at], slot.assignment.multiply, words);
      }
      return;
    case Kind::system:
      return decode_system(slot, words);
    case Kind::position:
    case Kind::program:
    case Kind::alarm:
      return;  // read-only
  }
}

void SnpxMemory::encode_position(const SnpxPosition& value, int multiply,
                                 std::span<Word> words) const {
  namespace pw = position_words;
  for (std::size_t i = 0; i < 6; ++i) {
    put_number(value.cartesian[i], multiply, &words[pw::cartesian - 1 + 2 * i]);
    put_number(value.joints[i], multiply, &words[pw::joints - 1 + 2 * i]);
  }
  words[pw::flip - 1] = value.configuration.flip ? 1 : 0;
  words[pw::flip + 1] = value.configuration.up ? 1 : 0;
  words[pw::flip + 2] = value.configuration.front ? 1 : 0;
  for (std::size_t i = 0; i < 3; ++i) {
    words[pw::turns - 1 + i] = static_cast<Word>(value.configuration.turns[i]);
  }
  words[pw::cartesian_valid - 1] = value.cartesian_valid ? 1 : 0;
  words[pw::joints_valid - 1] = value.joints_valid ? 1 : 0;
}

void SnpxMemory::decode_position(SnpxPosition& value, int multiply,
                                 std::span<const Word> words) const {
  namespace pw = position_words;
  for (std::size_t i = 0; i < 6; ++i) {
    value.cartesian[i] = get_number(&words[pw::cartesian - 1 + 2 * i], multiply);
    value.joints[i] = get_number(&words[pw::joints - 1 + 2 * i], multiply);
  }
  value.configuration.flip = words[pw::flip - 1] != 0;
  value.configuration.up = words[pw::flip + 1] != 0;
  value.configuration.front = words[pw::flip + 2] != 0;
  for (std::size_t i = 0; i < 3; ++i) {
    value.configuration.turns[i] = static_cast<std::int16_t>(words[pw::turns - 1 + i]);
  }
  value.cartesian_valid = words[pw::cartesian_valid - 1] != 0;
  value.joints_valid = words[pw::joints_valid - 1] != 0;
}

void SnpxMemory::encode_system(const Slot& slot, std::span<Word> words) const {
  int number = 0;
  std::string field;
  if (!parse_table_field(slot.variable.name, number, field)) return;  // others read 0
  const SnpxAssignment* entry = assignment(number);
  const SnpxAssignment shown = entry != nullptr ? *entry : SnpxAssignment{};
  if (field == "$VAR_NAME") return put_text(shown.variable, words);
  if (words.size() < 2) return;
  const int value = field == "$ADDRESS" ? shown.address
                    : field == "$SIZE"  ? shown.size
                                        : shown.multiply;
  put_number(value, slot.assignment.multiply, words.data());
}

void SnpxMemory::decode_system(const Slot& slot, std::span<const Word> words) {
  int number = 0;
  std::string field;
  if (!parse_table_field(slot.variable.name, number, field)) return;
  const SnpxAssignment* entry = assignment(number);
  SnpxAssignment changed = entry != nullptr ? *entry : SnpxAssignment{};
  changed.slot = number;
  if (field == "$VAR_NAME") {
    changed.variable = get_text(words);
  } else if (words.size() >= 2) {
    const int value =
        static_cast<int>(std::lround(get_number(words.data(), slot.assignment.multiply)));
    (field == "$ADDRESS" ? changed.address
     : field == "$SIZE"  ? changed.size
                         : changed.multiply) = value;
  }
  assign(changed);
}

}  // namespace berth
