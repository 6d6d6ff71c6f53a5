// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "logs/types/type_catalogue.h"

namespace berth::logs {

struct McapExport {
  std::uint64_t messages = 0;
  std::int64_t channels = 0;
  std::int64_t undecodable = 0;
  std::int64_t unknown = 0;  ///< of unknown types: left out
};

/// Writes a log as MCAP: each channel as a topic of JSON messages with a JSON schema, and in
/// addition the topics that Foxglove-compatible viewers draw (foxglove.h).
/// @throws InputError when the log cannot be read or the file is there; std::runtime_error when the
/// disk is full.
McapExport export_mcap(const std::filesystem::path& log, const std::filesystem::path& out,
                       const TypeCatalogue& types,
                       const std::function<bool(std::string_view)>& selected);

}  // namespace berth::logs
