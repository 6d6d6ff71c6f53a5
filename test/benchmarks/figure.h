// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace berth::benchmark {

/// A picture for gnuplot: data, then commands that plot it. Drawn as SVG and PNG.
class Figure {
 public:
  Figure(std::string name, int width, int height);

  /// A block of data that commands name as "$name".
  void data(const std::string& name, const std::vector<std::vector<double>>& rows);
  /// A line of gnuplot.
  void line(const std::string& command) { script_ += command + "\n"; }
  /// <directory>/<name>.svg and .png; reports on standard error when gnuplot fails.
  void draw(const std::filesystem::path& directory) const;

 private:
  std::string name_;
  int width_;
  int height_;
  std::string data_;
  std::string script_;
};

/// A colour for each of a few curves.
const char* colour_of(std::size_t curve);

/// Rows of numbers as CSV.
void write_numbers(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const std::vector<std::vector<double>>& rows);

}  // namespace berth::benchmark
