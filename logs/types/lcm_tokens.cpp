// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/lcm_tokens.h"

#include <algorithm>
#include <cctype>

namespace berth::logs {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.'; }
bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (is_space(text.front()) || text.front() == '*' || text.front() == '/')) {
    text.remove_prefix(1);
  }
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// A number may have a sign and an exponent with one: -1.5e-3.
std::size_t word_end(std::string_view text, std::size_t at) {
  const bool number =
      text[at] == '-' || text[at] == '+' || std::isdigit(static_cast<unsigned char>(text[at])) != 0;
  const bool hexadecimal = text.substr(at, 2) == "0x" || text.substr(at, 2) == "0X";
  std::size_t end = at + 1;
  while (end < text.size() &&
         (is_word(text[end]) || (number && !hexadecimal && (text[end] == '-' || text[end] == '+') &&
                                 (text[end - 1] == 'e' || text[end - 1] == 'E')))) {
    ++end;
  }
  return end;
}

}  // namespace

LcmTokens::LcmTokens(std::string_view text, std::string file) : file_(std::move(file)) {
  int line = 1;
  bool line_is_empty = true;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '\n') {
      ++line;
      line_is_empty = true;
      ++at;
    } else if (is_space(c)) {
      ++at;
    } else if (text.substr(at, 2) == "//") {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      add_comment(text.substr(at + 2, end - at - 2), line, line_is_empty);
      at = end;
    } else if (text.substr(at, 2) == "/*") {
      const std::size_t close = text.find("*/", at + 2);
      if (close == std::string_view::npos) {
        throw InputError(file_ + ":" + std::to_string(line) + ": found no end of this comment");
      }
      for (std::size_t from = at + 2; from <= close;) {
        const std::size_t end = std::min(text.find('\n', from), close);
        add_comment(text.substr(from, end - from), line, line_is_empty);
        if (end < close) {
          ++line;
          line_is_empty = true;
        }
        from = end + 1;
      }
      at = close + 2;
    } else {
      std::size_t end = at + 1;
      if (is_word(c) || c == '-' || c == '+') {
        end = word_end(text, at);
      } else if (std::string_view("{}[](),;=").find(c) == std::string_view::npos) {
        throw InputError(file_ + ":" + std::to_string(line) + ": found '" + std::string(1, c) +
                         "', which has no place in a message type");
      }
      tokens_.push_back({std::string(text.substr(at, end - at)), line});
      line_is_empty = false;
      at = end;
    }
  }
}

void LcmTokens::add_comment(std::string_view text, int line, bool alone) {
  text = trimmed(text);
  if (!text.empty()) comments_.push_back({std::string(text), line, alone});
}

std::string_view LcmTokens::peek() const {
  return at_end() ? std::string_view() : std::string_view(tokens_[next_].text);
}

int LcmTokens::line() const { return at_end() ? line_of_last() : tokens_[next_].line; }

std::string LcmTokens::take(const char* expected) {
  if (at_end()) throw error(std::string("found the end of the file, expected ") + expected);
  return tokens_[next_++].text;
}

bool LcmTokens::take_if(std::string_view word) {
  if (peek() != word) return false;
  ++next_;
  return true;
}

void LcmTokens::require(const char* word) {
  const std::string found = take((std::string("'") + word + "'").c_str());
  if (found != word) throw error("found '" + found + "', expected '" + word + "'");
}

std::string LcmTokens::name(const char* expected, bool with_package) {
  const std::string found = take(expected);
  const bool sound = !std::isdigit(static_cast<unsigned char>(found[0])) && found[0] != '.' &&
                     found.back() != '.' && found.find("..") == std::string::npos &&
                     std::all_of(found.begin(), found.end(), is_word) &&
                     (with_package || found.find('.') == std::string::npos);
  if (!sound) throw error("found '" + found + "', expected " + expected);
  return found;
}

std::string LcmTokens::comment(int first_line, int last_line) const {
  std::string behind;
  std::string above;
  int above_line = first_line;
  for (auto c = comments_.rbegin(); c != comments_.rend(); ++c) {
    if (!c->alone && c->line >= first_line && c->line <= last_line) {
      behind = c->text + (behind.empty() ? "" : " ") + behind;
    } else if (c->alone && c->line == above_line - 1) {
      above = c->text + (above.empty() ? "" : " ") + above;
      above_line = c->line;
    }
  }
  return behind.empty() ? above : behind;
}

InputError LcmTokens::error(const std::string& what) const {
  return InputError(file_ + ":" + std::to_string(line_of_last()) + ": " + what);
}

}  // namespace berth::logs
