// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "logs/types/type_catalogue.h"

namespace berth::logs {

struct CsvFile {
  std::filesystem::path path;
  std::string channel;
  std::int64_t rows = 0;
  std::int64_t undecodable = 0;  ///< messages that have no row
  std::string failure = {};      ///< why the file is not there, or not whole
};

/// Writes a file for each channel and type into a directory, CHANNEL.csv (FileNames). The header
/// names each column with its unit: "position_m[0] [m]". First comes log_utime, at which the logger
/// received the message; then its fields, arrays expanded to as many columns as the longest needs,
/// absent elements empty. A type with three arrays or more of one common size, or a very long one
/// (SCAN_DATA: one entry a beam) gets a row per entry instead, with the column "index". Channels of
/// unknown types have no file: left_out names them. selected: which channels. A file that cannot be
/// made, or is there already, leaves the others as they are. @throws InputError when the log cannot
/// be read.
std::vector<CsvFile> export_csv(const std::filesystem::path& log,
                                const std::filesystem::path& directory, const TypeCatalogue& types,
                                const std::function<bool(std::string_view)>& selected,
                                std::vector<std::string>& left_out);

}  // namespace berth::logs
