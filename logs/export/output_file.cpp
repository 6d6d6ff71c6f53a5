// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/output_file.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "common/core/error.h"

namespace berth::logs {

OutputFile::OutputFile(const std::filesystem::path& path)
    : name_(path.string()), buffer_(1 << 18), file_(std::fopen(path.c_str(), "wbx")) {
  if (file_ == nullptr) throw InputError(name_ + ": cannot be made: " + std::strerror(errno));
  std::setvbuf(file_, buffer_.data(), _IOFBF, buffer_.size());
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
}

void OutputFile::write(std::string_view bytes) {
  if (!bytes.empty() && std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail();
}

void OutputFile::close() {
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) fail();
}

void OutputFile::fail() const { throw std::runtime_error(name_ + ": " + std::strerror(errno)); }

}  // namespace berth::logs
