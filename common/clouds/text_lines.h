// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.h"

namespace berth::clouds {

/// The lines of a text file as words, and errors that name file and line.
class TextLines {
 public:
  /// Both must outlive this.
  TextLines(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  /// Goes to the next line, blank or not. @return false at the end.
  bool next();
  /// Of the present line, without what follows a '#' or "//".
  const std::vector<std::string_view>& words() const { return words_; }
  /// What follows the '#' or "//", as words.
  std::vector<std::string_view> comment() const;

  /// Word i of this line as a number. @throws InputError when it is missing or none.
  double number(std::size_t i, const char* name) const;
  /// The same for a count of at least one.
  std::size_t count(std::size_t i, const char* name) const;
  /// "file:line: what".
  InputError error(const std::string& what) const;

  std::size_t bytes_left() const { return text_.size(); }

 private:
  std::string_view text_;  ///< what is still to be read
  const std::string& file_;
  std::size_t line_ = 0;
  std::string_view comment_;
  std::vector<std::string_view> words_;
};

/// Words are parted by white space, commas or semicolons.
void split_words(std::string_view line, std::vector<std::string_view>& words);
/// "nan" and "inf" are numbers too. @return false when the word is none.
bool parse_number(std::string_view word, double& number);

}  // namespace berth::clouds
