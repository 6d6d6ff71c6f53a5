// SPDX-License-Identifier: BSD-3-Clause
#include "logs/file/log_writer.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "common/core/error.h"

namespace berth::logs {
namespace {

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
      buffer_(1 << 18),
      file_(std::fopen(path.c_str(), existing == Existing::refuse ? "wbx" : "wb")) {
  if (file_ == nullptr) {
    throw InputError(name_ + ": cannot be written: " + std::strerror(errno));
  }
  std::setvbuf(file_, buffer_.data(), _IOFBF, buffer_.size());
}

LogWriter::~LogWriter() { std::fclose(file_); }

void LogWriter::put(const void* data, std::size_t size) {
  if (size != 0 && std::fwrite(data, 1, size, file_) != size) {
    throw std::runtime_error(name_ + ": " + std::strerror(errno));
  }
}

void LogWriter::write(Utime utime, const std::string& channel, Bytes data) {
  std::array<std::uint8_t, format::header_bytes> header;
  std::uint8_t* at = header.data();
  at = big_endian(at, format::sync, 4);
  at = big_endian(at, number_++, 8);
  at = big_endian(at, utime, 8);
  at = big_endian(at, channel.size(), 4);
  big_endian(at, data.size(), 4);
  put(header.data(), header.size());
  put(channel.data(), channel.size());
  put(data.data(), data.size());
}

void LogWriter::copy(const LogEvent& event) {
  const Bytes record = record_of(event);
  put(record.data(), record.size());
  ++number_;
}

void LogWriter::flush() {
  if (std::fflush(file_) != 0) throw std::runtime_error(name_ + ": " + std::strerror(errno));
}

}  // namespace berth::logs
