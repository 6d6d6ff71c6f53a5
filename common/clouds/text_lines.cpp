// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/text_lines.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace berth::clouds {

namespace {

bool parts_words(char c) { return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == ';'; }

/// A word for a message: short, and fit to be printed.
std::string quoted(std::string_view word) {
  constexpr std::size_t most = 40;
  std::string text(word.substr(0, most));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return "'" + text + (word.size() > most ? "...'" : "'");
}

}  // namespace

void split_words(std::string_view line, std::vector<std::string_view>& words) {
  words.clear();
  std::size_t i = 0;
  while (i < line.size()) {
    if (parts_words(line[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < line.size() && !parts_words(line[end])) ++end;
    words.push_back(line.substr(i, end - i));
    i = end;
  }
}

bool parse_number(std::string_view word, double& number) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error == std::errc::result_out_of_range) {  // 1e999: no coordinate
    number = std::numeric_limits<double>::quiet_NaN();
  } else if (error != std::errc()) {
    return false;
  }
  return end == word.data() + word.size();
}

bool TextLines::next() {
  if (text_.empty()) return false;
  const std::size_t end = std::min(text_.find('\n'), text_.size());
  std::string_view line = text_.substr(0, end);
  text_.remove_prefix(std::min(end + 1, text_.size()));
  ++line_;
  comment_ = {};
  const std::size_t mark = std::min(line.find('#'), line.find("//"));
  if (mark != std::string_view::npos) {
    comment_ = line.substr(mark + (line[mark] == '#' ? 1 : 2));
    line = line.substr(0, mark);
  }
  split_words(line, words_);
  return true;
}

std::vector<std::string_view> TextLines::comment() const {
  std::vector<std::string_view> words;
  split_words(comment_, words);
  return words;
}

double TextLines::number(std::size_t i, const char* name) const {
  if (i >= words_.size()) {
    throw error("found " + std::to_string(words_.size()) + " columns, expected " + name +
                " in column " + std::to_string(i + 1));
  }
  double value = 0;
  if (!parse_number(words_[i], value)) {
    throw error("found " + quoted(words_[i]) + " for " + name + ", expected a number");
  }
  return value;
}

std::size_t TextLines::count(std::size_t i, const char* name) const {
  const double value = number(i, name);
  constexpr double most = 1e9;
  if (!(value >= 1 && value <= most && value == static_cast<double>(static_cast<long>(value)))) {
    throw error("found " + quoted(words_[i]) + " for " + name +
                ", expected a whole number of at least 1");
  }
  return static_cast<std::size_t>(value);
}

InputError TextLines::error(const std::string& what) const {
  return InputError(file_ + ":" + std::to_string(line_) + ": " + what);
}

}  // namespace berth::clouds
