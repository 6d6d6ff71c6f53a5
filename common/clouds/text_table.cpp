// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/text_table.h"

#include <algorithm>
#include <cctype>
#include <optional>

#include "common/clouds/text_lines.h"
#include "common/files/lines.h"

namespace berth::clouds {

namespace {

bool is_digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// "1,234": a decimal, or a thousand and more.
bool may_be_thousands(std::string_view cell) {
  if (!cell.empty() && (cell[0] == '-' || cell[0] == '+')) cell.remove_prefix(1);
  const auto comma = cell.find(',');
  return comma != std::string_view::npos && comma >= 1 && comma <= 3 && cell[0] != '0' &&
         is_digits(cell.substr(0, comma)) && cell.size() == comma + 4 &&
         is_digits(cell.substr(comma + 1));
}

/// The cells of a line that names columns. A unit that stands apart, as in "x [mm] y [mm]", belongs
/// to the name before it.
std::vector<std::string> names_in(std::string_view line, char delimiter) {
  std::vector<std::string_view> cells;
  split_cells(line, delimiter, cells);
  std::vector<std::string> names;
  for (const std::string_view cell : cells) {
    const char first = cell.empty() ? '\0' : cell[0];
    const bool is_unit = delimiter == ' ' && (first == '(' || first == '[') && !names.empty();
    if (is_unit) {
      names.back().append(cell);
    } else {
      names.emplace_back(cell);
    }
  }
  return names;
}

/// One way to read a text.
class Reading {
 public:
  Reading(std::string_view text, const std::string& file, TextFormat format,
          const DeclaredTable* declared)
      : file_(file), lines_(text, file, format, declared == nullptr ? 0 : declared->lines_before) {
    if (declared == nullptr) return;
    count_ = declared->rows;
    names_ = declared->names;
  }

  Table table() {
    const bool has_preamble = names_.empty();
    while (lines_.next()) {
      if (lines_.cells().empty()) {
        if (width_ == 0 && !lines_.comment().empty()) comments_.push_back(lines_.comment());
        continue;
      }
      if (width_ == 0) {
        if (has_preamble && (is_count() || is_header())) continue;
        begin();
      }
      add_row();
    }
    finish();
    return std::move(table_);
  }

 private:
  bool is_count() {
    const auto& cells = lines_.cells();
    const bool alone = std::all_of(cells.begin() + 1, cells.end(),
                                   [](std::string_view cell) { return cell.empty(); });
    std::int64_t count = 0;
    if (count_ || !names_.empty() || !alone || !files::parse_whole(cells[0], count) || count < 0) {
      return false;
    }
    count_ = static_cast<std::size_t>(count);
    return true;
  }

  bool is_header() {
    if (!names_.empty()) return false;
    for (const char delimiter : {lines_.format().delimiter, ';', '|', '\t', ',', ' '}) {
      names_ = names_in(lines_.text(), delimiter);
      if (find_columns(names_, where(lines_.line())).has_point()) {
        names_line_ = lines_.line();
        return true;
      }
    }
    names_.clear();
    return false;
  }

  /// Determines columns and their number at the first point.
  void begin() {
    const auto& cells = lines_.cells();
    width_ = cells.size();
    first_line_ = lines_.line();
    if (!names_.empty()) {
      fit_names();
    } else if (!take_comment()) {
      double ignored = 0;
      if (!parse_number(cells[0], lines_.format().decimal, ignored)) {
        throw lines_.error("found neither three numbers nor a header in " +
                           files::quoted(lines_.text()) +
                           ", expected points as 'x y z ...' or a line that names the columns x, "
                           "y, z and others");
      }
      table_.columns = Columns::first_three();
      constexpr std::size_t min_columns = 3;
      if (width_ < min_columns) {
        throw lines_.error("found " + std::to_string(width_) + " columns, expected x, y and z");
      }
      if (width_ > min_columns)
        table_.notes.push_back("x y z are the first columns: none has a name");
    }
  }

  void fit_names() {
    const auto& cells = lines_.cells();
    if (names_.size() == width_ + 1 && names_.back().empty()) names_.pop_back();
    if (width_ == names_.size() + 1 && cells.back().empty()) --width_;
    if (names_.size() != width_) throw wrong_width(names_.size(), "are named");
    table_.columns = find_columns(names_, where(names_line_));
    if (!table_.columns.has_point()) {
      std::string found;
      for (const std::string& name : names_) found += (found.empty() ? "" : " ") + name;
      throw InputError(file_ + ": found the fields '" + found +
                       "', expected x, y and z among them");
    }
  }

  /// @return whether a comment names the columns.
  bool take_comment() {
    bool in_order = true;
    for (auto comment = comments_.rbegin(); comment != comments_.rend(); ++comment) {
      for (const char delimiter : {lines_.format().delimiter, ',', ';', '\t', ' '}) {
        std::vector<std::string> names = names_in(*comment, delimiter);
        if (names.size() == width_ + 1 && names.back().empty()) names.pop_back();
        if (names.size() == width_) {
          table_.columns = find_columns(names, where(first_line_) + ": the comment above it");
          if (table_.columns.has_point()) {
            names_ = names;
            return true;
          }
        }
        in_order = in_order && allows_first_three(names);
      }
    }
    if (!in_order) {
      throw lines_.error("found " + std::to_string(width_) +
                         " columns, and above them a comment that names x, y and z otherwise: "
                         "expected it to name every column");
    }
    return false;
  }

  /// Whether a comment that does not list all columns is consistent with x y z as the first three.
  bool allows_first_three(const std::vector<std::string>& names) const {
    const auto place = [&](const char* name) {
      return std::find_if(names.begin(), names.end(),
                          [name](const std::string& other) {
                            return other.size() == 1 &&
                                   std::tolower(static_cast<unsigned char>(other[0])) == *name;
                          }) -
             names.begin();
    };
    const auto x = place("x");
    const auto y = place("y");
    const auto z = place("z");
    const auto count = static_cast<std::ptrdiff_t>(names.size());
    if (x == count || y == count || z == count) return true;
    return width_ == 3 ? x < y && y < z : x == 0 && y == 1 && z == 2;
  }

  LineError wrong_width(std::size_t expected, const std::string& why) const {
    const std::size_t found = lines_.cells().size();
    const bool decimal_commas = lines_.format().delimiter == ',' && found > expected;
    return lines_.error(
        "found " + std::to_string(found) + " columns, expected " + std::to_string(expected) +
        ": as many " + why +
        (decimal_commas ? " (numbers with a decimal comma cannot be parted by commas)" : ""));
  }

  void add_row() {
    const auto& cells = lines_.cells();
    const bool trailing = cells.size() == width_ + 1 && cells.back().empty();
    if (cells.size() != width_ && !trailing) {
      throw wrong_width(width_, "as in line " + std::to_string(first_line_));
    }
    const auto value = [&](const Column& column, const char* name) {
      return lines_.number(static_cast<std::size_t>(column.index), name);
    };
    const Columns& columns = table_.columns;
    CloudRow row;
    row.point = {value(columns.x, "x"), value(columns.y, "y"), value(columns.z, "z")};
    if (columns.sigma) row.sigma = value(columns.sigma, "sigma");
    if (columns.return_number) row.return_number = value(columns.return_number, "return_number");
    if (columns.time) {  // a date, or nothing: no reason to refuse the point
      const auto cell = cells[static_cast<std::size_t>(columns.time.index)];
      double time = 0;
      if (parse_number(cell, lines_.format().decimal, time)) row.time = time;
    }
    table_.rows.push_back(row);
    if (count_ && table_.rows.size() > *count_) throw wrong_count();
    look_for_ambiguity();
  }

  /// Refuses a text whose rows can all be read in two ways.
  void look_for_ambiguity() {
    const auto& cells = lines_.cells();
    const Columns& columns = table_.columns;
    bool all_there = true;
    for (const Column* column : {&columns.x, &columns.y, &columns.z}) {
      const std::string_view cell = cells[static_cast<std::size_t>(column->index)];
      all_there = all_there && !cell.empty();
      if (cell.find(',') == std::string_view::npos) continue;
      has_commas_ = true;
      only_thousands_ = only_thousands_ && may_be_thousands(cell);
    }
    has_whole_row_ = has_whole_row_ || all_there;
    for (std::size_t i = 0; i < std::min<std::size_t>(6, cells.size()) && may_be_halves_; ++i) {
      std::string_view cell = cells[i];
      if (i % 2 == 0 && !cell.empty() && cell[0] == '-') cell.remove_prefix(1);
      may_be_halves_ = is_digits(cell);
    }
    const auto row = static_cast<double>(table_.rows.size());
    const double x = table_.rows.back().point.x();
    counts_from_0_ = counts_from_0_ && x == row - 1;
    counts_from_1_ = counts_from_1_ && x == row;
  }

  void finish() const {
    if (count_ && table_.rows.size() != *count_) throw wrong_count();
    if (table_.rows.empty()) throw LineError(file_ + ": holds no point", lines_.line(), width_ + 1);
    if (names_.empty() && !has_whole_row_) {
      throw LineError(where(first_line_) +
                          ": x, y or z is empty in every line: expected them first, or a first "
                          "line that names the columns",
                      lines_.line(), width_ + 1);
    }
    if (has_commas_ && only_thousands_) {
      throw InputError(where(first_line_) +
                       ": found numbers as '1,234' alone, which may be decimals or thousands: "
                       "expected decimals with a point");
    }
    if (names_.empty() && lines_.format().delimiter == ',' && width_ >= 6 && may_be_halves_) {
      throw InputError(where(first_line_) +
                       ": found whole numbers between commas, which may be halves of numbers with "
                       "a decimal comma: expected a first line that names the columns, or "
                       "decimals with a point");
    }
    constexpr std::size_t min_to_count = 3;
    if (names_.empty() && width_ > 3 && table_.rows.size() >= min_to_count &&
        (counts_from_0_ || counts_from_1_)) {
      throw InputError(where(first_line_) +
                       ": the first column counts the lines, which x does not: expected a first "
                       "line that names the columns");
    }
  }

  LineError wrong_count() const {
    return lines_.error("found " + std::to_string(table_.rows.size()) + " points, expected the " +
                            std::to_string(*count_) + " declared",
                        width_ + 1);
  }

  std::string where(std::size_t line) const {
    return line == 0 ? file_ : file_ + ":" + std::to_string(line);
  }

  const std::string& file_;
  TextLines lines_;
  Table table_;
  std::optional<std::size_t> count_;  ///< of points, as declared
  std::vector<std::string> names_;
  std::size_t names_line_ = 0;
  std::vector<std::string_view> comments_;  ///< above the first point
  std::size_t width_ = 0;                   ///< columns; 0: before the first point
  std::size_t first_line_ = 0;
  bool has_whole_row_ = false;
  bool has_commas_ = false;
  bool only_thousands_ = true;
  bool may_be_halves_ = true;
  bool counts_from_0_ = true;
  bool counts_from_1_ = true;
};

/// "sep=;" declares the delimiter of a spreadsheet's cells. @return the delimiter, or 0.
char declared_delimiter(std::string_view text) {
  std::string_view line = text.substr(0, text.find_first_of("\r\n"));
  if (line.size() > 1 && line.front() == '"' && line.back() == '"') {
    line = line.substr(1, line.size() - 2);
  }
  return line.size() == 5 && line.substr(0, 4) == "sep=" ? line[4] : '\0';
}

}  // namespace

Table read_text_table(std::string_view text, const std::string& file,
                      const DeclaredTable* declared) {
  std::string delimiters;
  for (const char c : {';', '|', '\t', ','}) {
    if (declared == nullptr && text.find(c) != std::string_view::npos) delimiters += c;
  }
  delimiters += ' ';
  if (const char declared_character = declared == nullptr ? declared_delimiter(text) : '\0';
      declared_character != '\0') {
    delimiters = declared_character;
    text.remove_prefix(std::min(text.find_first_of("\r\n"), text.size()));
  }
  const bool has_comma = text.find(',') != std::string_view::npos;
  std::optional<LineError> fault;
  for (const char delimiter : delimiters) {
    for (const char decimal : {'.', ','}) {
      if (decimal == ',' && !has_comma) continue;
      try {
        return Reading(text, file, {delimiter, decimal}, declared).table();
      } catch (const LineError& error) {
        if (!fault || error.further_than(*fault)) fault = error;
      }
    }
  }
  throw LineError(*fault);
}

}  // namespace berth::clouds
