// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace berth {

/// All bytes of a file. @throws InputError when it cannot be read.
std::string read_file(const std::filesystem::path& path);

/// A file that is replaced atomically: whatever happens meanwhile, a power cut too, afterwards the
/// path holds either its former content or all that was written. Several processes may write the
/// same one: the last to finish wins.
class WholeFile {
 public:
  /// @throws InputError when it cannot be written, as do all functions here.
  explicit WholeFile(std::filesystem::path path);
  /// Without finish() the path is unchanged.
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  void write(std::string_view content);
  /// Syncs the content to the disk, then renames it into its place.
  void finish();

 private:
  std::filesystem::path path_;
  std::filesystem::path unfinished_;
  int fd_;
};

/// A whole file of this content. @throws InputError when it cannot be written.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Where files that do not outlive a program go: TMPDIR, else /tmp.
/// @throws InputError when there is no such directory.
std::filesystem::path temporary_directory();

/// Brings a file, or a directory's list of files, to the disk. @throws InputError.
void sync_to_disk(const std::filesystem::path& path);

}  // namespace berth
