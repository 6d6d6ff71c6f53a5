// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "logs/inspect/inspection.h"

namespace berth::logs {

struct Repair {
  std::int64_t written = 0;
  std::int64_t dropped = 0;       ///< events whose bytes are no message of their type
  std::vector<Finding> findings;  ///< what was left out: damage, and the first hundred dropped
  std::size_t damaged_bytes = 0;
};

/// Writes the sound part of a log into a new one: every event as it stood, with its number and
/// time, but for damaged bytes and for messages that do not belong to their channel: of a known
/// type that do not decode, or of an unknown type where the channel's own is known (a damaged
/// fingerprint). Channels without a known type are kept. Never overwrites.
/// @throws InputError when in cannot be read or out is there; std::runtime_error when the disk is
/// full: what was written until then is removed.
Repair repair(const std::filesystem::path& in, const std::filesystem::path& out,
              const TypeCatalogue& types);

}  // namespace berth::logs
