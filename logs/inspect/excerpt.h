// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "logs/file/timeline.h"

namespace berth::logs {

/// Which events of a log go into another. Channels by regular expressions (ECMAScript) that match
/// the whole name, as LCM's subscriptions do.
struct Excerpt {
  std::optional<Utime> from = {};  ///< from this place on the log's timeline on
  std::optional<Utime> to = {};    ///< up to this one
  std::string include = {};        ///< empty: all channels
  std::string exclude = {};        ///< empty: none
  std::string keep = {};           ///< channels that from and to do not touch; empty: none
};

struct ExcerptResult {
  std::int64_t written = 0;
  std::int64_t left_out = 0;
  std::size_t damaged_bytes = 0;
  std::vector<TimeStep> steps = {};  ///< in the whole log
};

/// Writes the excerpt into a new log; its events are numbered anew. Never overwrites.
/// @throws InputError for a regular expression that is none, or files as repair().
ExcerptResult write_excerpt(const std::filesystem::path& in, const std::filesystem::path& out,
                            const Excerpt& excerpt);

}  // namespace berth::logs
