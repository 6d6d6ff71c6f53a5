// SPDX-License-Identifier: BSD-3-Clause
#include "logs/file/log_reader.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/core/error.h"

namespace berth::logs {
namespace {

// As liblcm reads it: any channel without a zero byte, up to 999 bytes long; and an empty one,
// which its logger writes though it does not read it.
constexpr std::size_t max_channel_bytes = 999;
constexpr std::size_t largest_data = 0x7FFFFFFF;
constexpr std::uint8_t sync_bytes[4] = {0xED, 0xA1, 0xDA, 0x01};

std::uint64_t big_endian(const std::uint8_t* at, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | at[i];
  return value;
}

}  // namespace

LogReader::LogReader(const std::filesystem::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (fd < 0 || fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) {
    const int error = fd < 0 ? errno : EINVAL;
    if (fd >= 0) close(fd);
    throw InputError(path.string() + ": cannot be read: " + std::strerror(error));
  }
  size_ = static_cast<std::size_t>(status.st_size);
  void* mapped = size_ == 0 ? nullptr : mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, fd, 0);
  close(fd);
  if (mapped == MAP_FAILED) {
    throw InputError(path.string() + ": cannot be read: " + std::strerror(errno));
  }
  if (mapped != nullptr) madvise(mapped, size_, MADV_SEQUENTIAL);
  data_ = static_cast<const std::uint8_t*>(mapped);
}

LogReader::~LogReader() {
  if (data_ != nullptr) munmap(const_cast<std::uint8_t*>(data_), size_);
}

void LogReader::rewind() {
  at_ = 0;
  events_ = 0;
  numbers_ = {};
  step_ = SequenceCounter::Step::next;
  last_utime_ = 0;
  damage_.clear();
}

std::size_t LogReader::damaged_bytes() const {
  std::size_t sum = 0;
  for (const Damage& d : damage_) sum += d.bytes;
  return sum;
}

bool LogReader::sync_at(std::size_t at) const {
  return at + 4 <= size_ && std::memcmp(data_ + at, sync_bytes, 4) == 0;
}

/// Whether a sensible header stands here; end is where its event would end, maybe past the file.
bool LogReader::header_at(std::size_t at, LogEvent& event, std::size_t& end) const {
  if (at + format::header_bytes > size_ || !sync_at(at)) return false;
  const std::uint8_t* header = data_ + at;
  const std::uint64_t channel_bytes = big_endian(header + 20, 4);
  const std::uint64_t data_bytes = big_endian(header + 24, 4);
  if (channel_bytes > max_channel_bytes) return false;
  if (data_bytes > largest_data) return false;
  const std::size_t data_at = at + format::header_bytes + channel_bytes;
  if (data_at > size_) return false;
  const char* name = reinterpret_cast<const char*>(header + format::header_bytes);
  event.channel = {name, channel_bytes};
  if (event.channel.find('\0') != std::string_view::npos) return false;
  event.number = static_cast<std::int64_t>(big_endian(header + 4, 8));
  event.utime = static_cast<Utime>(big_endian(header + 12, 8));
  end = data_at + data_bytes;
  if (end <= size_) event.data = {data_ + data_at, data_bytes};
  return true;
}

/// The first place after `at` and before `limit` with a header whose event ends where another
/// begins; limit when there is none.
std::size_t LogReader::next_event_after(std::size_t at, std::size_t limit) const {
  const std::uint8_t* const stop = data_ + std::min(limit, size_);
  const std::uint8_t* from = data_ + at + 1;
  while (from < stop) {
    from = std::search(from, stop, std::begin(sync_bytes), std::end(sync_bytes));
    if (from == stop) break;
    const auto place = static_cast<std::size_t>(from - data_);
    LogEvent event;
    std::size_t end = 0;
    if (header_at(place, event, end) && end <= size_) return place;
    ++from;
  }
  return std::min(limit, size_);
}

void LogReader::skip_to(std::size_t at) {
  if (!damage_.empty() && damage_.back().offset + damage_.back().bytes == at_) {
    damage_.back().bytes += at - at_;
  } else {
    const std::int64_t last = events_ > 0 ? numbers_.last() : -1;
    damage_.push_back({at_, at - at_, last, last_utime_});
  }
  at_ = at;
}

bool LogReader::next(LogEvent& event) {
  while (at_ < size_) {
    std::size_t end = 0;
    if (!header_at(at_, event, end)) {
      skip_to(next_event_after(at_, size_));
      continue;
    }
    // An event not followed by another: its own length is wrong if a good event begins inside it,
    // else it is the next header that is damaged and this event is good.
    if (end > size_ || (end != size_ && !sync_at(end))) {
      const std::size_t inside = next_event_after(at_, end);
      if (end > size_ || inside < end) {
        skip_to(inside);
        continue;
      }
    }
    event.offset = at_;
    at_ = end;
    ++events_;
    step_ = numbers_.take(event.number);
    last_utime_ = event.utime;
    return true;
  }
  return false;
}

}  // namespace berth::logs
