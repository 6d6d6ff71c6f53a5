// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace berth::logs {

/// Names for the files of one directory, made of any text: no two are one name, on a file system
/// that does not tell capitals from small letters either.
class FileNames {
 public:
  /// The text as a file's name: signs that file systems or shells treat in a way of their own are
  /// '_', and it is cut to 80 bytes.
  static std::string cleaned(std::string_view text);

  /// cleaned(text), with "-2", "-3" ... before the extension when it was given out before.
  std::string unique(std::string_view text, const std::string& extension);

 private:
  std::set<std::string> given_;  ///< in small letters
};

}  // namespace berth::logs
