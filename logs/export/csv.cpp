// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/csv.h"

#include <charconv>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "logs/export/output_file.h"
#include "logs/file/log_reader.h"
#include "logs/types/value.h"

namespace berth::logs {
namespace {

/// How a type's messages become rows: learnt from all of them, as arrays have a size of their own
/// in each.
class CsvColumns {
 public:
  explicit CsvColumns(const StructType& type);

  /// Call for every message, then settle() once, then header() and rows().
  void learn(const Value& message) { learn(type_, message, shape_); }
  void settle();

  std::string header() const;
  /// One line, or one for each entry; each begins with prefix.
  void rows(const Value& message, const std::string& prefix, std::string& out,
            std::int64_t& count) const;

 private:
  /// Greatest length of each dimension of each field, and of what is within.
  struct Shape {
    std::vector<std::vector<std::size_t>> lengths;
    std::vector<std::unique_ptr<Shape>> within;
  };
  static void prepare(const StructType& type, Shape& shape);
  static void learn(const StructType& type, const Value& value, Shape& shape);
  static void learn_array(const Field& field, const Value& value, std::size_t dimension,
                          std::vector<std::size_t>& lengths, Shape* within);
  void names(const StructType& type, const Shape& shape, const std::string& prefix, bool top,
             std::string& out) const;
  void array_names(const Field& field, const std::vector<std::size_t>& lengths, const Shape* within,
                   std::size_t dimension, const std::string& name, std::string& out) const;
  void cells(const StructType& type, const Shape& shape, const Value* value, bool top,
             std::size_t entry, std::string& out) const;
  void array_cells(const Field& field, const std::vector<std::size_t>& lengths, const Shape* within,
                   std::size_t dimension, const Value* value, std::string& out) const;
  /// Of the field that is spread over rows.
  bool is_long(const Field& field, bool top) const;

  const StructType& type_;
  Shape shape_;
  int long_count_ = -1;  ///< index of the field with the number of entries; -1: a row a message
};

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

namespace fs = std::filesystem;

/// All messages of one type on one channel.
struct Table {
  explicit Table(const StructType& of) : type(of), columns(of) {}
  const StructType& type;
  CsvColumns columns;
  std::unique_ptr<OutputFile> file;
  CsvFile figures;
};

using Key = std::pair<std::string_view, std::uint64_t>;

/// Does it unless the table's file failed before.
template <class Write>
void attempt(Table& table, Write write) {
  if (!table.figures.failure.empty()) return;
  try {
    write();
  } catch (const std::runtime_error& e) {
    table.figures.failure = e.what();
  }
}

}  // namespace

std::vector<CsvFile> export_csv(const fs::path& log, const fs::path& directory,
                                const TypeCatalogue& types,
                                const std::function<bool(std::string_view)>& selected,
                                std::vector<std::string>& left_out) {
  LogReader reader(log);
  std::map<Key, Table> tables;
  std::map<std::string_view, std::int64_t> unknown;
  LogEvent event;
  while (reader.next(event)) {
    if (!selected(event.channel)) continue;
    const StructType* type = types.type_of(event.data);
    if (type == nullptr) {
      ++unknown[event.channel];
      continue;
    }
    Table& table = tables.try_emplace({event.channel, type->fingerprint}, *type).first->second;
    if (const auto value = decode_value(*type, event.data)) {
      table.columns.learn(*value);
    } else {
      ++table.figures.undecodable;
    }
  }
  fs::create_directories(directory);
  std::map<std::string_view, int> types_of_channel;
  // Names that need no change are given first, so that they do not give way to made ones.
  FileNames names;
  for (const bool changed : {false, true}) {
    for (auto& [key, table] : tables) {
      if ((FileNames::cleaned(key.first) != key.first) != changed) continue;
      const int number = types_of_channel[key.first]++;
      const std::string name = std::string(key.first) + (number == 0 ? "" : "-" + table.type.name);
      table.figures.path = directory / names.unique(name, ".csv");
      table.figures.channel = key.first;
      table.columns.settle();
      attempt(table, [&table = table] {
        table.file = std::make_unique<OutputFile>(table.figures.path);
        table.file->write("log_utime [us]" + table.columns.header() + "\n");
      });
    }
  }
  reader.rewind();
  std::string rows;
  while (reader.next(event)) {
    const auto found = tables.find({event.channel, fingerprint_of(event.data)});
    if (found == tables.end()) continue;
    Table& table = found->second;
    const auto value = decode_value(table.type, event.data);
    if (!value) continue;
    rows.clear();
    attempt(table, [&] {
      table.columns.rows(*value, std::to_string(event.utime), rows, table.figures.rows);
      table.file->write(rows);
    });
  }
  std::vector<CsvFile> files;
  for (auto& [key, table] : tables) {
    attempt(table, [&table = table] { table.file->close(); });
    files.push_back(table.figures);
  }
  for (const auto& [channel, messages] : unknown) {
    left_out.push_back(std::string(channel) + " (" + std::to_string(messages) + " messages)");
  }
  return files;
}

}  // namespace berth::logs
