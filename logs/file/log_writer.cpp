// SPDX-License-Identifier: BSD-3-Clause
#include "logs/file/log_writer.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "common/core/error.h"

namespace berth::logs {
namespace {

constexpr std::size_t buffer_size = 1 << 18;

template <class Integer>
std::uint8_t* big_endian(std::uint8_t* at, Integer value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) {
    *at++ = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
  return at;
}

}  // namespace

LogWriter::LogWriter(const std::filesystem::path& path, Existing existing)
    : name_(path.string()),
      file_(std::fopen(path.c_str(), existing == Existing::refuse ? "wbx" : "wb")) {
  if (file_ == nullptr) {
    throw InputError(name_ + ": cannot be written: " + std::strerror(errno));
  }
  std::setvbuf(file_, nullptr, _IONBF, 0);
  buffer_.reserve(buffer_size);
}

LogWriter::~LogWriter() {
  std::fwrite(buffer_.data(), 1, buffer_.size(), file_);
  std::fclose(file_);
}

void LogWriter::put(Bytes bytes) {
  if (buffer_.size() + bytes.size() > buffer_size) write_out();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void LogWriter::write_out() {
  const std::size_t written = std::fwrite(buffer_.data(), 1, buffer_.size(), file_);
  const bool all = written == buffer_.size();
  buffer_.clear();
  if (!all) throw std::runtime_error(name_ + ": " + std::strerror(errno));
}

void LogWriter::write(Utime utime, const std::string& channel, Bytes data) {
  std::array<std::uint8_t, format::header_bytes> header;
  std::uint8_t* at = header.data();
  at = big_endian(at, format::sync, 4);
  at = big_endian(at, number_++, 8);
  at = big_endian(at, utime, 8);
  at = big_endian(at, channel.size(), 4);
  big_endian(at, data.size(), 4);
  put(header);
  put({reinterpret_cast<const std::uint8_t*>(channel.data()), channel.size()});
  put(data);
}

void LogWriter::copy(const LogEvent& event) {
  put(record_of(event));
  ++number_;
}

void LogWriter::flush() { write_out(); }

}  // namespace berth::logs
