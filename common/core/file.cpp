// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

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
    // A pipe without a writer would keep us waiting, a directory would read as an empty file.
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

void write_file(const fs::path& path, std::string_view content) {
  fs::path unfinished = path;
  unfinished += ".part";
  const int fd = open(unfinished.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) fail(unfinished, errno);
  int error = 0;
  while (!content.empty() && error == 0) {
    const ssize_t written = write(fd, content.data(), content.size());
    if (written >= 0) {
      content.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      error = errno;
    }
  }
  if (error == 0 && fsync(fd) != 0) error = errno;
  close(fd);
  if (error == 0 && rename(unfinished.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    unlink(unfinished.c_str());
    fail(path, error);
  }
  sync_to_disk(path.has_parent_path() ? path.parent_path() : fs::path("."));
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
