// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace berth {

/// "0.1.0+1a2b3c4" with "-dirty" behind it when the tree had uncommitted changes.
const char* version();

}  // namespace berth
