// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace berth::logs {

/// A new file that is written from its beginning to its end: never replaces one.
class OutputFile {
 public:
  /// @throws InputError when the file is there already or cannot be made.
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// @throws std::runtime_error when the disk is full.
  void write(std::string_view bytes);
  /// Brings everything to the file. @throws std::runtime_error when the disk is full.
  void close();

 private:
  [[noreturn]] void fail() const;

  std::string name_;
  std::vector<char> buffer_;  // of the file: glibc makes none larger than a page by itself
  std::FILE* file_;
};

}  // namespace berth::logs
