// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <filesystem>
#include <set>
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

/// Names for the files of one directory, made of any text: no two are one name, on a file system
/// that does not tell capitals from small letters either.
class FileNames {
 public:
  /// The text as a file's name: signs that file systems or shells treat in a way of their own are
  /// '_', and it is cut to 80 bytes.
  static std::string cleaned(std::string_view text);

  /// cleaned(text), with "-2", "-3" ... before the extension when it was given out before.
  std::string unique(std::string_view text, const std::string& extension);

 private:
  std::set<std::string> given_;  ///< in small letters
};

}  // namespace berth::logs
