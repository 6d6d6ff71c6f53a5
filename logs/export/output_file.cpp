// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/output_file.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "common/core/error.h"
#include "common/core/valid_text.h"

namespace berth::logs {
namespace {

constexpr std::size_t max_bytes = 80;  // bytes, of which each may become three

bool is_plain(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x80 || std::isalnum(byte) != 0 ||
         std::string_view("._-+=@, ").find(c) != std::string_view::npos;
}

}  // namespace

std::string FileNames::cleaned(std::string_view text) {
  std::string name = valid_utf8(text.substr(0, max_bytes));
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !is_plain(c); }, '_');
  if (name.empty()) return "_";
  for (char* end : {&name.front(), &name.back()}) {
    if (std::string_view("._- ").find(*end) != std::string_view::npos) *end = '_';
  }
  return name;
}

std::string FileNames::unique(std::string_view text, const std::string& extension) {
  const std::string name = cleaned(text);
  for (int number = 1;; ++number) {
    const std::string file = name + (number == 1 ? "" : "-" + std::to_string(number)) + extension;
    std::string small = file;
    for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (given_.insert(small).second) return file;
  }
}

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
