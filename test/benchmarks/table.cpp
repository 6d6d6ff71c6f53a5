// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "common/core/file.h"
#include "common/core/text.h"

namespace berth::benchmark {

Table::Table(std::string name, std::string title, const std::vector<std::string>& columns)
    : name_(std::move(name)),
      title_(std::move(title)),
      table_{std::string(columns.size(), 'l'), {columns.begin(), columns.end()}} {}

void Table::add(std::vector<std::string> cells) {
  cells.resize(table_.head.size());
  table_.rows.push_back(std::vector<berth::Table::Cell>(cells.begin(), cells.end()));
}

void Table::judge(std::vector<std::string> cells, bool pass) {
  cells.emplace_back(pass ? "pass" : "MISS");
  if (!pass) ++missed_;
  add(std::move(cells));
}

void Table::publish(const std::filesystem::path& directory) const {
  std::printf("\n%s\n%s", title_.c_str(), text_table(table_).c_str());
  std::fflush(stdout);
  write_file(directory / (name_ + ".csv"), csv_table(table_));
  write_file(directory / (name_ + ".md"), markdown_table(table_));
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

}  // namespace berth::benchmark
