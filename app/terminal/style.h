// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace berth::terminal {

enum class Style { plain, strong, faint, good, warning, bad };

struct TerminalSize {
  std::size_t rows = 24;
  std::size_t columns = 80;
};
/// Size of the terminal at this descriptor, 24 x 80 where it does not report one; nothing where it
/// is no terminal.
std::optional<TerminalSize> terminal_size(int fd);

/// Whether to write colours to this descriptor: a terminal that knows them, and NO_COLOR
/// (no-color.org) is not set.
bool use_colours(int fd);

/// One line of text in several styles; whatever characters it is given, it drives no terminal.
class Line {
 public:
  Line() = default;
  Line(const std::string& text, Style style = Style::plain) { add(text, style); }

  Line& add(const std::string& text, Style style = Style::plain);
  /// Blanks up to a column; at least one.
  Line& tab(std::size_t column);
  /// Columns: characters, not bytes.
  std::size_t width() const;
  /// With ANSI colours or without; cut to width (0: not cut).
  std::string rendered(bool colours, std::size_t width = 0) const;

 private:
  struct Part {
    std::string text;
    Style style;
  };
  std::vector<Part> parts_;
};

/// Breaks text between words into lines no wider than width.
std::vector<std::string> wrapped(const std::string& text, std::size_t width);

/// "12.3 s", "4 min 05 s", "2 h 03 min".
std::string text_of_duration(double seconds);

}  // namespace berth::terminal
