// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.h"

namespace berth::logs {

/// The words of a .lcm file one after another, comments apart.
class LcmTokens {
 public:
  /// file: for messages. @throws InputError for a character that has no place in such a file.
  LcmTokens(std::string_view text, std::string file);

  bool at_end() const { return next_ == tokens_.size(); }
  /// The next word, or "" at the end.
  std::string_view peek() const;
  /// Line of the next word.
  int line() const;
  int line_of_last() const { return next_ == 0 ? 1 : tokens_[next_ - 1].line; }

  /// The next word. @throws InputError at the end; expected: for the message.
  std::string take(const char* expected);
  bool take_if(std::string_view word);
  void require(const char* word);
  /// A name: letters, digits and '_', not a digit first; with dots when it may have a package.
  std::string name(const char* expected, bool with_package = false);

  /// The comment behind a declaration that ends in this line; else the one in the lines above it.
  std::string comment(int first_line, int last_line) const;

  /// "file:line: found '...', expected ..."; at the last word taken.
  InputError error(const std::string& what) const;

 private:
  struct Token {
    std::string text;
    int line;
  };
  struct Comment {
    std::string text;
    int line;
    bool alone;  ///< nothing stands before it in its line
  };

  void add_comment(std::string_view text, int line, bool alone);

  std::string file_;
  std::vector<Token> tokens_;
  std::vector<Comment> comments_;  ///< one a line, in order
  std::size_t next_ = 0;
};

}  // namespace berth::logs
