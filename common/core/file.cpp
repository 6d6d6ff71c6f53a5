// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "common/core/error.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const fs::path& path, int error) {
  throw InputError(path.string() + ": cannot be written: " + std::strerror(error));
}

}  // namespace

std::string read_file(const fs::path& path) {
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  if (fs::exists(fs::file_status(type)) && type != fs::file_type::regular) {
    // A pipe without a writer would block, a directory would read as an empty file.
    const char* const found = type == fs::file_type::directory ? "a directory" : "no regular file";
    throw InputError(path.string() + ": is " + found + ", expected a file");
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path.string() + ": cannot be read");
  std::ostringstream content;
  content << in.rdbuf();
  if (in.bad()) throw InputError(path.string() + ": cannot be read to its end");
  return content.str();
}

WholeFile::WholeFile(fs::path path)
    : path_(std::move(path)),
      unfinished_(path_.string() + "." + std::to_string(getpid()) + ".part"),
      fd_(open(unfinished_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
  if (fd_ < 0) fail(path_, errno);
}

WholeFile::~WholeFile() {
  if (fd_ < 0) return;
  close(fd_);
  unlink(unfinished_.c_str());
}

void WholeFile::write(std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(fd_, content.data(), content.size());
    if (written >= 0) {
      content.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      fail(path_, errno);
    }
  }
}

void WholeFile::finish() {
  if (fsync(fd_) != 0 || rename(unfinished_.c_str(), path_.c_str()) != 0) fail(path_, errno);
  close(std::exchange(fd_, -1));
  sync_to_disk(path_.has_parent_path() ? path_.parent_path() : fs::path("."));
}

void write_file(const fs::path& path, std::string_view content) {
  WholeFile file(path);
  file.write(content);
  file.finish();
}

fs::path temporary_directory() {
  const char* given = std::getenv("TMPDIR");
  const fs::path directory = given != nullptr && *given != '\0' ? given : "/tmp";
  std::error_code error;
  if (fs::is_directory(directory, error)) return directory;
  throw InputError(directory.string() +
                   ": found no such folder for temporary files; make it, or set "
                   "TMPDIR to one that is there");
}

void sync_to_disk(const fs::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) fail(path, errno);
  const int error = fsync(fd) == 0 ? 0 : errno;
  close(fd);
  if (error != 0) fail(path, error);
}

}  // namespace berth
