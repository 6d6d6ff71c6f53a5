// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/table.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <utility>

#include "common/core/error.h"
#include "common/core/text.h"

namespace berth::benchmark {
namespace {

void print_row(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    std::printf("%-*s%s", static_cast<int>(widths[i]), cells[i].c_str(),
                i + 1 < cells.size() ? "  " : "\n");
  }
}

std::string quoted(const std::string& cell) {
  return cell.find(',') == std::string::npos ? cell : '"' + cell + '"';
}

}  // namespace

Table::Table(std::string name, std::string title, std::vector<std::string> columns)
    : name_(std::move(name)), title_(std::move(title)), columns_(std::move(columns)) {}

void Table::add(std::vector<std::string> cells) {
  cells.resize(columns_.size());
  rows_.push_back(std::move(cells));
}

void Table::judge(std::vector<std::string> cells, bool pass) {
  cells.emplace_back(pass ? "pass" : "MISS");
  if (!pass) ++missed_;
  add(std::move(cells));
}

void Table::publish(const std::filesystem::path& directory) const {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    std::size_t width = columns_[c].size();
    for (const auto& row : rows_) width = std::max(width, row[c].size());
    widths.push_back(width);
  }
  std::printf("\n%s\n", title_.c_str());
  print_row(columns_, widths);
  for (const auto& row : rows_) print_row(row, widths);
  std::fflush(stdout);
  write_csv(directory / (name_ + ".csv"), columns_, rows_);
  write_markdown(directory / (name_ + ".md"), columns_, rows_);
}

std::string number(double value, int decimals) {
  return std::isfinite(value) ? fixed(value, decimals) : "-";
}

std::string share(int successes, int trials) {
  const Bounds interval = wilson(successes, trials);
  return with_interval(100.0 * successes / std::max(1, trials),
                       {100 * interval.low, 100 * interval.high}, 1);
}

std::string with_interval(double value, const Bounds& interval, int decimals) {
  return number(value, decimals) + " (" + number(interval.low, decimals) + ".." +
         number(interval.high, decimals) + ")";
}

void write_csv(const std::filesystem::path& path, const std::vector<std::string>& columns,
               const std::vector<std::vector<std::string>>& rows) {
  std::ofstream out(path);
  const auto put = [&out](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) out << (i == 0 ? "" : ",") << quoted(cells[i]);
    out << '\n';
  };
  put(columns);
  for (const auto& row : rows) put(row);
  if (!out.flush()) throw InputError(path.string() + ": cannot be written");
}

void write_markdown(const std::filesystem::path& path, const std::vector<std::string>& columns,
                    const std::vector<std::vector<std::string>>& rows) {
  std::ofstream out(path);
  const auto put = [&out](const std::vector<std::string>& cells) {
    out << '|';
    for (const std::string& cell : cells) out << ' ' << cell << " |";
    out << '\n';
  };
  put(columns);
  put(std::vector<std::string>(columns.size(), "---"));
  for (const auto& row : rows) put(row);
  if (!out.flush()) throw InputError(path.string() + ": cannot be written");
}

void progress(const std::string& what, int done, int of) {
  static const bool terminal = isatty(2) != 0;
  if (terminal) {
    std::fprintf(stderr, "\r\033[K%s: %d of %d%s", what.c_str(), done, of,
                 done < of ? "" : "\r\033[K");
  } else if (done == of) {
    std::fprintf(stderr, "%s: %d done\n", what.c_str(), done);
  }
}

}  // namespace berth::benchmark
