// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/reestimation/old_keys.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace berth {
namespace {

/// A key of estimator.yaml as it was, all that it holds with it.
struct OldKey {
  std::string_view key;
  std::string_view value;    ///< that is no more; empty: the key is no more, whatever its value
  std::string_view present;  ///< instead of the value
};

constexpr std::array old_keys = {
    // Replaced by methods that need no options of theirs.
    OldKey{"acquisition.method", "views", "hypotheses"},
    OldKey{"acquisition.views", "", ""},
    OldKey{"tracking.method", "beam", "likelihood"},
    OldKey{"tracking.beam", "", ""},
    // Beams are always as wide as the scanner says of itself.
    OldKey{"likelihood.footprint", "", ""},
    // A constant of the filter.
    OldKey{"target_tracker.se3.iterations", "", ""},
};

const OldKey* old_key(const std::string& key, const YamlNode& value) {
  const auto* found = std::find_if(old_keys.begin(), old_keys.end(), [&](const OldKey& old) {
    return old.key == key && (old.value.empty() || old.value == value.text());
  });
  return found == old_keys.end() ? nullptr : found;
}

YamlNode present(const YamlNode& map, const std::string& prefix) {
  YamlNode result(YamlNode::Kind::map);
  bool same = true;
  for (const auto& [key, value] : map.entries()) {
    const std::string name = prefix + key.text();
    YamlNode now = value;
    if (const OldKey* old = old_key(name, value)) {
      same = false;
      if (old->value.empty()) continue;
      now = YamlNode(std::string(old->present));
    } else if (value.is_map()) {
      now = present(value, name + ".");
      same = same && now.is(value);
    }
    result.add(key, now);
  }
  return same ? map : result;
}

}  // namespace

YamlNode with_present_keys(const YamlNode& estimator) { return present(estimator, ""); }

}  // namespace berth
