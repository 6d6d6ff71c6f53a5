// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/loop.h"
#include "logs/file/log_event.h"

namespace berth::logs {

/// Writes the stock LCM log format, as lcm-logger does: the twin's recorder, and logs made of logs.
class LogWriter {
 public:
  enum class Existing { replace, refuse };

  /// @throws InputError when the file cannot be made, or is there and must not be replaced.
  explicit LogWriter(const std::filesystem::path& path, Existing existing = Existing::replace);
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Appends one event; numbers count from 0. @throws std::runtime_error when the disk is full.
  void write(Utime utime, const std::string& channel, Bytes data);
  /// Appends an event of another log as it stands there, with its own number.
  void copy(const LogEvent& event);
  /// Brings everything written to the file. @throws std::runtime_error when the disk is full.
  void flush();

  std::int64_t events() const { return number_; }

 private:
  void put(Bytes bytes);
  void write_out();

  std::string name_;
  std::vector<std::uint8_t> buffer_;  // what is not in the file yet
  std::FILE* file_;                   // without a buffer of its own
  std::int64_t number_ = 0;
};

/// A log made of another: never replaces a file, and is removed when it is not finished.
class DerivedLog {
 public:
  /// @throws InputError when the file is there already or cannot be made.
  explicit DerivedLog(const std::filesystem::path& path)
      : path_(path), writer_(path, LogWriter::Existing::refuse) {}
  ~DerivedLog() {
    std::error_code ignored;
    if (!finished_) std::filesystem::remove(path_, ignored);
  }
  DerivedLog(const DerivedLog&) = delete;
  DerivedLog& operator=(const DerivedLog&) = delete;

  LogWriter& writer() { return writer_; }
  /// @throws std::runtime_error when the disk is full.
  void finish() {
    writer_.flush();
    finished_ = true;
  }

 private:
  std::filesystem::path path_;
  LogWriter writer_;
  bool finished_ = false;
};

}  // namespace berth::logs
