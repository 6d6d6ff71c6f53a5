// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.h"

namespace berth::clouds {

/// Delimiter of cells and format of numbers, the same for a whole file.
struct TextFormat {
  char delimiter = ' ';  ///< ' ': any run of blanks and tabs, between which no cell is empty
  char decimal = '.';
};

/// An error in a line. Of two ways to read the file, the error of the one that got further is
/// reported.
class LineError : public InputError {
 public:
  LineError(const std::string& text, std::size_t line, std::size_t cell)
      : InputError(text), line_(line), cell_(cell) {}
  bool further_than(const LineError& other) const {
    return line_ != other.line_ ? line_ > other.line_ : cell_ > other.cell_;
  }

 private:
  std::size_t line_;
  std::size_t cell_;
};

/// The bytes of a text file as UTF-8: without byte order mark, from UTF-16 by that mark.
/// file: for messages. @throws InputError when they are no text.
std::string text_of(std::string bytes, const std::string& file);

/// The lines of a text as cells, and errors that name file and line. Lines end with LF, CRLF or CR.
class TextLines {
 public:
  /// text and file must outlive this. lines_before: of the file, before the text.
  TextLines(std::string_view text, const std::string& file, TextFormat format = {},
            std::size_t lines_before = 0)
      : text_(text), file_(file), format_(format), line_(lines_before) {}

  /// Goes to the next line, blank or not. @return false at the end.
  bool next();
  /// Of the present line, without blanks around them, quotes, or the line's comment.
  const std::vector<std::string_view>& cells() const { return cells_; }
  /// The present line, without its comment.
  std::string_view text() const { return line_text_; }
  /// What follows a '#' or "//" after a blank or at the line's start; the line behind a '%' there.
  std::string_view comment() const { return comment_; }

  /// Cell i of this line; NaN where it marks a missing number: empty, NA, 1.#QNAN, ...
  /// @throws LineError when it is missing or none.
  double number(std::size_t i, const char* name) const;
  /// The same for a count of at least one.
  std::size_t count(std::size_t i, const char* name) const;
  /// "file:line: what". cell: how far the line could be read.
  LineError error(const std::string& what, std::size_t cell = 0) const;

  const TextFormat& format() const { return format_; }
  std::size_t line() const { return line_; }
  std::size_t bytes_left() const { return text_.size(); }

 private:
  std::string_view text_;  ///< what is still to be read
  const std::string& file_;
  TextFormat format_;
  std::size_t line_;
  std::string_view line_text_;
  std::string_view comment_;
  std::vector<std::string_view> cells_;
};

/// The cells of a line.
void split_cells(std::string_view line, char delimiter, std::vector<std::string_view>& cells);
/// A cell as a number; NaN for one that marks a missing number. @return false for anything else.
bool parse_number(std::string_view cell, char decimal, double& number);

}  // namespace berth::clouds
