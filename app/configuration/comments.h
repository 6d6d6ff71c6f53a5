// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

namespace berth {

/// The comments on the keys of a YAML text, by path ("arms.joints[].low"): the comment behind a
/// key, with the lines below that go on in its column; else the lines right above it. A key that is
/// commented out counts: `# key: value   # its comment`. The first lines, with the licence, belong
/// to the file itself.
std::map<std::string, std::string> comments_of_keys(const std::string& text);

}  // namespace berth
