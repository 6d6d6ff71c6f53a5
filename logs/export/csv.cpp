// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/csv.h"

#include <map>

#include "common/core/error.h"
#include "logs/export/csv_columns.h"
#include "logs/export/file_names.h"
#include "logs/export/output_file.h"
#include "logs/file/log_reader.h"

namespace berth::logs {
namespace {

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
                                const std::function<bool(std::string_view)>& wanted,
                                std::vector<std::string>& left_out) {
  LogReader reader(log);
  std::map<Key, Table> tables;
  std::map<std::string_view, std::int64_t> unknown;
  LogEvent event;
  while (reader.next(event)) {
    if (!wanted(event.channel)) continue;
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
  // Names that can stay as they are go first: who has one need not give way to one that is made.
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
