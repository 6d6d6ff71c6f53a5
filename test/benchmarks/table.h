// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/table.h"
#include "test/benchmarks/statistics.h"

namespace berth::benchmark {

/// What is printed and written as CSV. A row that is held against a target ends in "pass" or
/// "MISS".
class Table {
 public:
  Table(std::string name, std::string title, const std::vector<std::string>& columns);

  void add(std::vector<std::string> cells);
  /// A row with a verdict.
  void judge(std::vector<std::string> cells, bool pass);

  /// Prints it and writes <directory>/<name>.csv and .md. @throws InputError when that cannot be
  /// written.
  void publish(const std::filesystem::path& directory) const;
  int missed() const { return missed_; }

 private:
  std::string name_;
  std::string title_;
  berth::Table table_;
  int missed_ = 0;
};

std::string number(double value, int decimals = 2);
/// Share as per cent with its Wilson interval: "99.5 % (98.8..99.8)".
std::string share(int successes, int trials);
/// "1.04 (1.02..1.07)"
std::string with_interval(double value, const Bounds& interval, int decimals = 2);

}  // namespace berth::benchmark
