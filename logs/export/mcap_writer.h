// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "logs/export/output_file.h"

namespace berth::logs {

/// Writes MCAP (mcap.dev, version 0): messages in zstd-compressed chunks with an index each; a
/// summary with schemas, channels, chunk indexes and statistics; all checksums.
class McapWriter {
 public:
  using Nanoseconds = std::uint64_t;

  /// @throws InputError when the file is there already or cannot be made. What is written throws
  /// std::runtime_error when the disk is full.
  McapWriter(const std::filesystem::path& path, const std::string& library);

  std::uint16_t add_schema(const std::string& name, const std::string& encoding,
                           const std::string& data);
  std::uint16_t add_channel(std::uint16_t schema, const std::string& topic,
                            const std::string& encoding);
  void write(std::uint16_t channel, Nanoseconds log_time, std::string_view data);
  /// Writes the summary; call it last.
  void close();

  std::uint64_t messages() const { return messages_; }

 private:
  struct Channel {
    std::string record;
    std::uint64_t messages = 0;
    std::string index;  ///< of the open chunk: (time, offset) pairs
  };
  struct Chunk {
    Nanoseconds first = UINT64_MAX;
    Nanoseconds last = 0;
    std::string records;
  };

  void put(std::string_view bytes);
  void close_chunk();
  std::string statistics() const;

  OutputFile file_;
  std::uint64_t at_ = 0;
  std::uint32_t crc_ = 0;             ///< of all bytes so far
  std::vector<std::string> schemas_;  ///< records
  std::vector<Channel> channels_;     ///< channel id i + 1
  Chunk chunk_;
  std::vector<std::string> chunk_indexes_;  ///< records
  std::string compressed_;
  std::uint64_t messages_ = 0;
  Nanoseconds first_ = UINT64_MAX;
  Nanoseconds last_ = 0;
};

}  // namespace berth::logs
