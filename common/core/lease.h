// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace berth {

/// The right to command: of one commander at a time, as long as it renews it. Times in us.
class Lease {
 public:
  explicit Lease(std::int64_t lifetime) : lifetime_(lifetime) {}

  /// @return false when another commander holds it.
  bool take(const std::string& commander, std::int64_t now) {
    if (held(now) && holder_ != commander) return false;
    holder_ = commander;
    expires_ = now + lifetime_;
    return true;
  }
  /// @return false when this commander does not hold it.
  bool keep(const std::string& commander, std::int64_t now) {
    return held_by(commander, now) && take(commander, now);
  }
  bool release(const std::string& commander, std::int64_t now) {
    if (!held_by(commander, now)) return false;
    holder_.clear();
    expires_ = 0;
    return true;
  }
  bool held(std::int64_t now) const { return !holder_.empty() && now <= expires_; }
  bool held_by(const std::string& commander, std::int64_t now) const {
    return held(now) && holder_ == commander;
  }
  /// True once, when the holder has not renewed it in time.
  bool lapse(std::int64_t now) {
    if (holder_.empty() || now <= expires_) return false;
    holder_.clear();
    expires_ = 0;
    return true;
  }
  const std::string& holder() const { return holder_; }
  std::int64_t expires() const { return expires_; }

 private:
  std::int64_t lifetime_;
  std::string holder_;
  std::int64_t expires_ = 0;
};

}  // namespace berth
