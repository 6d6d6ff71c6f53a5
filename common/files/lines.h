// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.h"

namespace berth::files {

/// The lines of a text, as words between blanks. Lines end with LF or CR LF; in a text without any
/// LF, with CR. A byte order mark at the start is skipped.
class Lines {
 public:
  /// text must outlive this. first: number of its first line.
  Lines(std::string_view text, std::string file, std::size_t first = 1);

  /// Goes to the next line that is not blank. @return false at the end.
  bool next();
  /// Of the present line, without its comment.
  const std::vector<std::string_view>& words() const { return words_; }
  /// The present line from the start of word i, blanks at its end cut off: names may hold blanks.
  std::string_view rest(std::size_t i) const;
  std::size_t number() const { return number_; }
  /// Offset in the text of the line after the present one.
  std::size_t offset() const { return at_; }
  bool at_end() const { return at_ >= text_.size(); }

  /// A line that ends with continuation goes on in the next one; a word that begins with comment
  /// begins a comment, which ends with the line. 0: there are none.
  void set_marks(char continuation, char comment);

  /// "file:line: what".
  InputError error(const std::string& what) const;

 private:
  std::string_view take();
  bool goes_on(std::string_view line) const;
  void split(std::string_view line);

  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  std::size_t number_ = 0;
  std::size_t next_number_ = 1;
  char end_ = '\n';
  char continuation_ = 0;
  char comment_ = 0;
  std::string joined_;  ///< a line that was continued
  std::vector<std::string_view> words_;
};

/// A number as programs write it, whatever the locale; "nan", "inf" and 1.#QNAN are numbers too. A
/// value too small for a double is 0, one too large infinite. @return false when the word is none.
bool parse_number(std::string_view word, double& number);
/// A whole number in decimal digits. @return false when the word is none, or too large.
bool parse_whole(std::string_view word, std::int64_t& number);
/// A word for a message: short, quoted, and fit to be printed.
std::string quoted(std::string_view word);

}  // namespace berth::files
