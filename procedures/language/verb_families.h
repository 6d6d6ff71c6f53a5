// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "procedures/language/verbs.h"

namespace berth::procedures {

// The verbs by what they are about, each with its reader; verbs() joins them.
std::vector<VerbInfo> cell_verbs();
std::vector<VerbInfo> motion_verbs();
std::vector<VerbInfo> scan_verbs();
std::vector<VerbInfo> operator_verbs();

/// For verbs that take nothing. @throws InputError when something stands behind it.
void expect_nothing(Config& step, const std::string& verb);

}  // namespace berth::procedures
