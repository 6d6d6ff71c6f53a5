// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/csv_columns.h"

#include <charconv>
#include <map>

#include "common/core/valid_text.h"

namespace berth::logs {
namespace {

/// An array of basic values that is longer makes rows instead of columns.
constexpr std::size_t widest = 64;

template <class Number>
void append_number(Number value, std::string& out) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  out.append(text, end);
}

void append(const Value& value, std::string& out) {
  std::visit(
      [&out](const auto& v) {
        using Type = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<Type, bool>) {
          out += v ? '1' : '0';
        } else if constexpr (std::is_arithmetic_v<Type>) {
          append_number(v, out);
        } else if constexpr (std::is_same_v<Type, std::string_view>) {
          out += csv_field(v);
        }
      },
      value.content);
}

}  // namespace

CsvColumns::CsvColumns(const StructType& type) : type_(type) { prepare(type, shape_); }

void CsvColumns::prepare(const StructType& type, Shape& shape) {
  for (const Field& field : type.fields) {
    shape.lengths.emplace_back(field.dimensions.size(), 0);
    shape.within.emplace_back();
  }
}

void CsvColumns::learn(const StructType& type, const Value& value, Shape& shape) {
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    const Field& field = type.fields[i];
    if (field.kind != Kind::structure && field.dimensions.empty()) continue;
    if (field.kind == Kind::structure && !shape.within[i]) {
      shape.within[i] = std::make_unique<Shape>();
      prepare(*field.structure, *shape.within[i]);
    }
    learn_array(field, value.list()[i], 0, shape.lengths[i], shape.within[i].get());
  }
}

void CsvColumns::learn_array(const Field& field, const Value& value, std::size_t dimension,
                             std::vector<std::size_t>& lengths, Shape* within) {
  if (dimension == lengths.size()) {
    if (field.kind == Kind::structure) learn(*field.structure, value, *within);
    return;
  }
  const Value::List& list = value.list();
  lengths[dimension] = std::max(lengths[dimension], list.size());
  if (dimension + 1 == lengths.size() && field.kind != Kind::structure) return;
  for (const Value& v : list) learn_array(field, v, dimension + 1, lengths, within);
}

/// Three arrays or more of one size are a table of their own; so is an array that is too wide.
void CsvColumns::settle() {
  std::map<int, int> arrays_of;
  for (std::size_t i = 0; i < type_.fields.size(); ++i) {
    const Field& field = type_.fields[i];
    if (field.dimensions.size() != 1 || field.kind == Kind::structure) continue;
    const int count_field = field.dimensions[0].count_field;
    if (count_field < 0) continue;
    if (++arrays_of[count_field] == 3 || shape_.lengths[i][0] > widest) {
      long_count_ = count_field;
      return;
    }
  }
}

bool CsvColumns::is_long(const Field& field, bool top) const {
  return top && long_count_ >= 0 && field.dimensions.size() == 1 &&
         field.dimensions[0].count_field == long_count_ && field.kind != Kind::structure;
}

std::string CsvColumns::header() const {
  std::string out;
  if (long_count_ >= 0) out += ",index";
  names(type_, shape_, "", true, out);
  return out;
}

void CsvColumns::names(const StructType& type, const Shape& shape, const std::string& prefix,
                       bool top, std::string& out) const {
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    const Field& field = type.fields[i];
    const std::size_t first = is_long(field, top) ? 1 : 0;
    array_names(field, shape.lengths[i], shape.within[i].get(), first, prefix + field.name, out);
  }
}

void CsvColumns::array_names(const Field& field, const std::vector<std::size_t>& lengths,
                             const Shape* within, std::size_t dimension, const std::string& name,
                             std::string& out) const {
  if (dimension < lengths.size()) {
    for (std::size_t k = 0; k < lengths[dimension]; ++k) {
      array_names(field, lengths, within, dimension + 1, name + "[" + std::to_string(k) + "]", out);
    }
  } else if (field.kind == Kind::structure) {
    if (within != nullptr) names(*field.structure, *within, name + ".", false, out);
  } else {
    out += "," + csv_field(name + (field.unit.empty() ? "" : " [" + field.unit + "]"));
  }
}

void CsvColumns::rows(const Value& message, const std::string& prefix, std::string& out,
                      std::int64_t& count) const {
  std::size_t entries = 1;
  if (long_count_ >= 0) {
    entries = static_cast<std::size_t>(
        std::get<std::int64_t>(message.list()[static_cast<std::size_t>(long_count_)].content));
  }
  for (std::size_t entry = 0; entry < entries; ++entry) {
    out += prefix;
    if (long_count_ >= 0) {
      out += ',';
      append_number(entry, out);
    }
    cells(type_, shape_, &message, true, entry, out);
    out += '\n';
    ++count;
  }
}

/// value: null makes empty cells.
void CsvColumns::cells(const StructType& type, const Shape& shape, const Value* value, bool top,
                       std::size_t entry, std::string& out) const {
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    const Field& field = type.fields[i];
    const Value* content = value == nullptr ? nullptr : &value->list()[i];
    if (is_long(field, top)) {
      array_cells(field, shape.lengths[i], nullptr, 1, &content->list()[entry], out);
    } else {
      array_cells(field, shape.lengths[i], shape.within[i].get(), 0, content, out);
    }
  }
}

void CsvColumns::array_cells(const Field& field, const std::vector<std::size_t>& lengths,
                             const Shape* within, std::size_t dimension, const Value* value,
                             std::string& out) const {
  if (dimension < lengths.size()) {
    for (std::size_t k = 0; k < lengths[dimension]; ++k) {
      const bool there = value != nullptr && k < value->list().size();
      array_cells(field, lengths, within, dimension + 1, there ? &value->list()[k] : nullptr, out);
    }
  } else if (field.kind == Kind::structure) {
    if (within != nullptr) cells(*field.structure, *within, value, false, 0, out);
  } else {
    out += ',';
    if (value != nullptr) append(*value, out);
  }
}

}  // namespace berth::logs
