// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "logs/file/log_writer.h"

namespace berth::logs {

/// A log that is made of another: never replaces a file, and goes again when it is not finished.
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
