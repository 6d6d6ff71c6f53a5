// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <new>
#include <string>
#include <system_error>
#include <type_traits>

namespace berth {

/// Values that this process shares with the copies of it that it forks later. What both write at a
/// time must be atomic.
template <class T>
class SharedValues {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  /// @throws std::system_error when there is no memory.
  explicit SharedValues(std::size_t count) : count_(std::max<std::size_t>(count, 1)) {
    void* const memory = mmap(nullptr, count_ * sizeof(T), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "mmap");
    values_ = static_cast<T*>(memory);
    for (std::size_t i = 0; i < count_; ++i) new (values_ + i) T();
  }
  ~SharedValues() { munmap(values_, count_ * sizeof(T)); }
  SharedValues(const SharedValues&) = delete;
  SharedValues& operator=(const SharedValues&) = delete;

  T& operator[](std::size_t i) { return values_[i]; }
  const T& operator[](std::size_t i) const { return values_[i]; }

 private:
  std::size_t count_;
  T* values_ = nullptr;
};

/// A text among shared values, cut off where it is longer.
class SharedText {
 public:
  void set(const std::string& text) { text_[text.copy(text_, sizeof text_ - 1)] = 0; }
  std::string get() const { return text_; }

 private:
  char text_[1000] = {};
};

}  // namespace berth
