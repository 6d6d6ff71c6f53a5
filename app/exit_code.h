// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Exit codes of every command of Berth.
namespace berth::exit_code {

inline constexpr int passed = 0;
inline constexpr int failed = 1;  ///< a criterion failed
inline constexpr int error = 2;   ///< the rig, the input, or a time-out
inline constexpr int aborted = 3;
inline constexpr int inconclusive = 4;

/// The worst of two, as returned by every command that runs or judges several: passed,
/// inconclusive, failed, error, aborted. What is complete comes first: passed, open, failed. A run
/// that the cell or its input spoiled has no answer and must be mended and run again; an abort is a
/// person's decision that ended whatever would have followed. Codes that are none of these (of a
/// process that died) are errors.
constexpr int worst(int a, int b) {
  const auto rank = [](int code) {
    switch (code) {
      case passed:
        return 0;
      case inconclusive:
        return 1;
      case failed:
        return 2;
      case aborted:
        return 4;
      default:
        return 3;
    }
  };
  return rank(b) > rank(a) ? b : a;
}

}  // namespace berth::exit_code
