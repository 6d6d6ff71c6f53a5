// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "logs/file/log_writer.h"
#include "logs/types/type_catalogue.h"

namespace berth {

/// A file of its own that goes with the test.
struct TemporaryFile {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() /
      ("berth-log-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
  ~TemporaryFile() { std::filesystem::remove(path); }
  static inline int count = 0;
};

/// Our own messages' types.
inline const logs::TypeCatalogue& our_types() {
  static const logs::TypeCatalogue types = [] {
    logs::TypeCatalogue t;
    t.add("lcmtypes");
    return t;
  }();
  return types;
}

inline std::vector<std::uint8_t> bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void overwrite(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

template <class Message>
std::vector<std::uint8_t> encoded(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class Message>
void write_message(logs::LogWriter& writer, Utime utime, const char* channel,
                   const Message& message) {
  writer.write(utime, channel, encoded(message));
}

}  // namespace berth
