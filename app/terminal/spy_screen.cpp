// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/spy_screen.h"

#include <algorithm>
#include <iterator>

#include "common/core/valid_text.h"

namespace berth {
namespace {

constexpr int page = 20;
constexpr char reverse[] = "\x1b[7m";
constexpr char faint[] = "\x1b[2m";
constexpr char plain[] = "\x1b[0m";
constexpr char end_of_line[] = "\x1b[K\r\n";

/// Index of the selected channel among all; 0 when it is not there.
int index_of(const std::string& selected, const SpyModel& model) {
  const auto found = model.channels().find(selected);
  return found == model.channels().end()
             ? 0
             : static_cast<int>(std::distance(model.channels().begin(), found));
}

std::string cut(const std::string& line, int columns) {
  return std::string(first_columns(line, static_cast<std::size_t>(std::max(columns, 0))));
}

}  // namespace

void SpyScreen::move(int by, const SpyModel& model) {
  if (opened_) {
    scroll_ = std::max(0, scroll_ + by);
    return;
  }
  const int count = static_cast<int>(model.channels().size());
  if (count == 0) return;
  const int index = std::clamp(index_of(selected_, model) + by, 0, count - 1);
  selected_ = std::next(model.channels().begin(), index)->first;
}

void SpyScreen::open(const SpyModel& model) {
  const int count = static_cast<int>(model.channels().size());
  if (!digits_.empty()) {
    const int number = std::atoi(digits_.c_str());
    digits_.clear();
    if (number < 1 || number > count) return;
    selected_ = std::next(model.channels().begin(), number - 1)->first;
  } else {
    move(0, model);
  }
  opened_ = count > 0;
  scroll_ = 0;
}

bool SpyScreen::key(const std::string& key, const SpyModel& model) {
  if (key == "\x1b[A" || key == "k") {
    move(-1, model);
  } else if (key == "\x1b[B" || key == "j") {
    move(1, model);
  } else if (key == "\x1b[5~") {
    move(-page, model);
  } else if (key == "\x1b[6~" || key == " ") {
    move(page, model);
  } else if (key == "\r" || key == "\n" || key == "\x1b[C") {
    if (!opened_) open(model);
  } else if (key.size() == 1 && key[0] >= '0' && key[0] <= '9') {
    if (digits_.size() < 4) digits_ += key;
  } else if (key == "\x1b" || key == "\x1b[D" || key == "\x7f") {
    if (!digits_.empty()) {
      digits_.clear();
    } else if (opened_) {
      opened_ = false;
    }
  } else if (key == "q") {
    if (!opened_) return false;
    opened_ = false;
  }
  return key != "\x03";
}

std::string SpyScreen::draw(const SpyModel& model, Utime now, int rows, int columns) const {
  std::vector<std::string> lines = channel_table(model, now, true);
  const int index = index_of(selected_, model);
  std::string out = "\x1b[H";
  int body = std::max(rows - 3, 1);
  if (!opened_) {
    const int first = std::max(0, index - body + 1);
    out += std::string(faint) + cut(lines[0], columns) + plain + end_of_line;
    for (int i = first; i < first + body && i + 1 < static_cast<int>(lines.size()); ++i) {
      const std::string line = cut(lines[static_cast<std::size_t>(i) + 1], columns);
      out += (i == index ? reverse + line + plain : line) + end_of_line;
    }
  } else {
    out += std::string(faint) + cut(lines[0], columns) + plain + end_of_line;
    out += cut(lines[static_cast<std::size_t>(index) + 1], columns) + end_of_line;
    --body;
    const auto fields = field_lines(std::next(model.channels().begin(), index)->second);
    const int first = std::min(scroll_, std::max(0, static_cast<int>(fields.size()) - body));
    for (int i = first; i < first + body && i < static_cast<int>(fields.size()); ++i) {
      out += cut("  " + fields[static_cast<std::size_t>(i)], columns) + end_of_line;
    }
  }
  const std::string help = opened_
                               ? "up/down: scroll   left, q: back"
                               : "up/down, number, Enter: open a channel   q: quit   " + digits_;
  return out + faint + cut(help, columns) + plain + "\x1b[K\x1b[J";
}

}  // namespace berth
