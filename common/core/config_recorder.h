// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/bounds.h"

namespace berth {

/// A key of a configuration file, as the call that reads it defines it.
struct ConfigKey {
  enum class Kind {
    quantity,
    quantities,  ///< list
    integer,
    integers,
    boolean,
    text,
    texts,
    choice,  ///< one of words
    pose,    ///< [x, y, z, w, p, r] in mm and degrees
    map,
    maps,   ///< list
    other,  ///< a grammar of its own; `kind` names it
  };
  std::string file = {};
  std::string path = {};  ///< "arms.joints[].low"; NAME stands for a name of the user's own
  Kind kind = Kind::other;
  Dimension dimension = Dimension::number;  ///< of quantities
  int size = 0;                             ///< of a list; 0: any
  ValueBounds bounds = {};
  std::vector<std::string> words = {};
  bool required = true;
  std::string default_value = {};  ///< default, as written in a file; empty: none
  std::string value = {};          ///< in this file; empty: left out
};

/// While it lives, it records the keys of every file and text that its thread begins to read as a
/// Config, present or not.
class ConfigRecorder {
 public:
  ConfigRecorder();
  ~ConfigRecorder();
  ConfigRecorder(const ConfigRecorder&) = delete;
  ConfigRecorder& operator=(const ConfigRecorder&) = delete;

  /// The recorder of this thread; nullptr: none.
  static ConfigRecorder* current();

  void add(ConfigKey key) { keys_.push_back(std::move(key)); }
  /// In the order in which they were read; a key that was read twice is listed twice.
  const std::vector<ConfigKey>& keys() const { return keys_; }

 private:
  ConfigRecorder* before_;
  std::vector<ConfigKey> keys_;
};

}  // namespace berth
