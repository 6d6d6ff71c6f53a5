// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth {

/// The word nearest by edit distance (Levenshtein), at most three edits away; empty when none is.
std::string nearest_word(const std::string& word, const std::vector<std::string>& known);

}  // namespace berth
