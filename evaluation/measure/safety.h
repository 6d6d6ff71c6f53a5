// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace berth::evaluation {

/// The family of what is only known once something has gone wrong: it cannot be foreseen.
inline constexpr char safety_family[] = "safety: how faults are answered";

}  // namespace berth::evaluation
