// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/loop.h"

namespace berth::logs {

/// Writes the stock LCM log format, as lcm-logger does: the twin's recorder.
class LogWriter {
 public:
  /// @throws InputError when the file cannot be made.
  explicit LogWriter(const std::filesystem::path& path);
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Appends one event; numbers count from 0. @throws std::runtime_error when the disk is full.
  void write(Utime utime, const std::string& channel, Bytes data);
  /// Brings everything written to the file. @throws std::runtime_error when the disk is full.
  void flush();

  std::int64_t events() const { return number_; }

 private:
  void put(const void* data, std::size_t size);

  std::string name_;
  std::FILE* file_;
  std::int64_t number_ = 0;
};

}  // namespace berth::logs
