// SPDX-License-Identifier: BSD-3-Clause
#include "common/files/lines.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace berth::files {
namespace {

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// std::from_chars knows no plus sign.
std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

/// Of a number that no double holds, whether it is too small rather than too large: its first digit
/// other than 0 stands so many places before the point.
double beyond_double(std::string_view word) {
  const bool negative = word[0] == '-';
  const std::size_t exponent_at = std::min(word.find_first_of("eE"), word.size());
  const std::string_view digits = word.substr(0, exponent_at);
  const std::size_t point = std::min(digits.find('.'), digits.size());
  const std::size_t first = std::min(digits.find_first_of("123456789"), digits.size());
  const double places = static_cast<double>(point) - static_cast<double>(first);
  double exponent = 0;
  if (exponent_at + 1 < word.size()) {
    const std::string_view text = without_plus(word.substr(exponent_at + 1));
    std::int64_t value = 0;
    if (!parse_whole(text, value))
      value = std::numeric_limits<int>::max() * (text[0] == '-' ? -1 : 1);
    exponent = static_cast<double>(value);
  }
  const double size = places + exponent < 0 ? 0 : std::numeric_limits<double>::infinity();
  return negative ? -size : size;
}

/// How older Windows programs write what is no number: 1.#QNAN, -1.#IND, 1.#INF.
bool is_windows_nan(std::string_view word) {
  if (!word.empty() && word[0] == '-') word.remove_prefix(1);
  return word.size() > 3 && word.substr(0, 3) == "1.#" &&
         word.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789", 3) ==
             std::string_view::npos;
}

}  // namespace

Lines::Lines(std::string_view text, std::string file, std::size_t first)
    : text_(text), file_(std::move(file)), number_(first), next_number_(first) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text_.substr(0, byte_order_mark.size()) == byte_order_mark) at_ = byte_order_mark.size();
  if (text_.find('\n') == std::string_view::npos) end_ = '\r';
}

void Lines::set_marks(char continuation, char comment) {
  continuation_ = continuation;
  comment_ = comment;
}

/// The next line of the text, without its comment and the blanks at its end.
std::string_view Lines::take() {
  const std::size_t end = std::min(text_.find(end_, at_), text_.size());
  std::string_view line = text_.substr(at_, end - at_);
  at_ = std::min(end + 1, text_.size());
  ++next_number_;
  if (comment_ != 0) {
    std::size_t mark = line.find(comment_);
    while (mark != std::string_view::npos && mark > 0 && !blank(line[mark - 1])) {
      mark = line.find(comment_, mark + 1);
    }
    line = line.substr(0, mark);
  }
  while (!line.empty() && blank(line.back())) line.remove_suffix(1);
  return line;
}

bool Lines::goes_on(std::string_view line) const {
  return continuation_ != 0 && !line.empty() && line.back() == continuation_ && !at_end();
}

void Lines::split(std::string_view line) {
  words_.clear();
  std::size_t i = 0;
  while (i < line.size()) {
    if (blank(line[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < line.size() && !blank(line[end])) ++end;
    words_.push_back(line.substr(i, end - i));
    i = end;
  }
}

bool Lines::next() {
  words_.clear();
  while (words_.empty() && !at_end()) {
    number_ = next_number_;
    std::string_view line = take();
    if (goes_on(line)) {
      joined_.clear();
      for (; goes_on(line); line = take()) {
        joined_.append(line.substr(0, line.size() - 1)).push_back(' ');
      }
      line = joined_.append(line);
    }
    split(line);
  }
  return !words_.empty();
}

std::string_view Lines::rest(std::size_t i) const {
  if (i >= words_.size()) return {};
  const char* const begin = words_[i].data();
  const std::string_view last = words_.back();
  return {begin, static_cast<std::size_t>(last.data() + last.size() - begin)};
}

InputError Lines::error(const std::string& what) const {
  return InputError(file_ + ":" + std::to_string(number_) + ": " + what);
}

bool parse_number(std::string_view word, double& number) {
  word = without_plus(word);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (is_windows_nan(word)) {
    number = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  if (error == std::errc::result_out_of_range) {
    number = beyond_double(word);
  } else if (error != std::errc()) {
    return false;
  }
  return end == word.data() + word.size();
}

bool parse_whole(std::string_view word, std::int64_t& number) {
  word = without_plus(word);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc() && end == word.data() + word.size();
}

std::string quoted(std::string_view word) {
  constexpr std::size_t max_length = 40;
  std::string text(word.substr(0, max_length));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return "'" + text + (word.size() > max_length ? "...'" : "'");
}

}  // namespace berth::files
