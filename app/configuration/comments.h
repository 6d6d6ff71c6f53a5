// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

namespace berth {

/// What the comments of a YAML text say of its keys, by path ("arms.joints[].low"): the comment
/// behind a key, with the lines below that go on in its column; else the lines right above it. A
/// key that is commented out counts: `# key: value   # its comment`. The first lines, with the
/// licence, are the file's own.
std::map<std::string, std::string> comments_of_keys(const std::string& text);

}  // namespace berth
