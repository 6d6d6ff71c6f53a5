// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/version.h"

namespace berth {

// Where no program says better: tests, which need not be linked again at every commit.
[[gnu::weak]] const char* version() { return "unversioned"; }

}  // namespace berth
