// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace berth::logs {

/// Counts what is missing from numbers that should go up by one. A number that was damaged on its
/// way, one that comes late and a count that begins anew are distinguished from a gap.
class SequenceCounter {
 public:
  enum class Step {
    next,       ///< first of all, or as it should be
    repeat,     ///< the same again
    gap,        ///< missing_before() numbers were left out
    late,       ///< one that was taken for missing
    restart,    ///< counts from anew
    corrected,  ///< the number before was damaged: its step does not hold
  };

  Step take(std::int64_t number) {
    const Step step = judge(number);
    if (step != Step::repeat && step != Step::late) last_ = number;
    jumped_ = step == Step::gap || step == Step::restart;
    return step;
  }

  std::int64_t missing() const { return missing_; }
  /// Of the last gap.
  std::int64_t missing_before() const { return jump_; }
  std::int64_t last() const { return last_; }

 private:
  static constexpr std::int64_t latest = 1000;  ///< numbers by which one may be late
  static constexpr std::int64_t max_jump = std::int64_t{1} << 40;

  Step judge(std::int64_t number) {
    if (!begun_) {
      begun_ = true;
      return Step::next;
    }
    if (jumped_ && number == before_ + 2) {
      missing_ -= jump_;
      return Step::corrected;
    }
    if (number == last_ + 1) return Step::next;
    if (number == last_) return Step::repeat;
    if (number < last_ && missing_ > 0 && last_ - number <= latest) {
      --missing_;
      return Step::late;
    }
    before_ = last_;
    jump_ = 0;
    if (number < last_) return Step::restart;
    jump_ = number - last_ > max_jump || number - last_ < 0 ? max_jump : number - last_ - 1;
    missing_ += jump_;
    return Step::gap;
  }

  bool begun_ = false;
  bool jumped_ = false;
  std::int64_t last_ = 0;
  std::int64_t before_ = 0;
  std::int64_t jump_ = 0;
  std::int64_t missing_ = 0;
};

}  // namespace berth::logs
