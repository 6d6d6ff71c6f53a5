// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/version.h"

namespace berth {

// Default of programs that define none: tests, so that a commit does not relink them.
[[gnu::weak]] const char* version() { return "unversioned"; }

}  // namespace berth
