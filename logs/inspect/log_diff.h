// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "common/bus/loop.h"
#include "logs/inspect/channel_pattern.h"
#include "logs/types/type_catalogue.h"

namespace berth::logs {

struct DiffOptions {
  bool ignore_times = false;  ///< fields called utime..., session
  std::string ignore_fields;  ///< regular expression of paths, as "counters[0].value"
  double tolerance = 0;       ///< numbers of type float and double: |a - b| <= tolerance
  std::string channels;       ///< regular expression; empty: all
};

/// The messages of one channel in two logs: the n-th with one seq of one sender there against the
/// n-th here; where a type has no seq, the n-th against the n-th.
struct ChannelDiff {
  std::int64_t same = 0;
  std::int64_t different = 0;
  std::int64_t only_a = 0;
  std::int64_t only_b = 0;
  /// The first that differs.
  std::string field;  ///< path; empty: the bytes of an undecodable or unknown message
  std::string value_a;
  std::string value_b;
  Utime utime_a = 0;   ///< at which a's logger received it
  double largest = 0;  ///< greatest |a - b| of all numbers of type float and double

  bool equal() const { return different == 0 && only_a == 0 && only_b == 0; }
};

using LogDiff = std::map<std::string, ChannelDiff>;

/// @throws InputError when a log cannot be read, or a regular expression is none.
LogDiff diff_logs(const std::filesystem::path& a, const std::filesystem::path& b,
                  const TypeCatalogue& types, const DiffOptions& options);

bool equal(const LogDiff& diff);
std::string text_of(const LogDiff& diff);
nlohmann::ordered_json json_of(const LogDiff& diff);

}  // namespace berth::logs
