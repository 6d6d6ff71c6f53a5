// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// What every command of Berth says to the shell.
namespace berth::exit_code {

inline constexpr int passed = 0;
inline constexpr int failed = 1;  ///< a criterion failed
inline constexpr int error = 2;   ///< the rig, the input, or a time-out
inline constexpr int aborted = 3;
inline constexpr int inconclusive = 4;

}  // namespace berth::exit_code
