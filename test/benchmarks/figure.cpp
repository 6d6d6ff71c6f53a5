// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/figure.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <utility>

#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "test/benchmarks/table.h"

namespace berth::benchmark {
namespace {

std::string quoted(const std::filesystem::path& path) {
  std::string text;
  for (const char c : path.string()) text += c == '\'' ? std::string("''") : std::string(1, c);
  return "'" + text + "'";
}

std::string short_number(double value) {
  if (!std::isfinite(value)) return "NaN";
  char text[32];
  std::snprintf(text, sizeof text, "%.7g", value);
  return text;
}

bool run_gnuplot(const std::string& script) {
  try {
    return feed_program({"gnuplot"}, script, {}).ok();
  } catch (const InputError&) {  // it is not there
    return false;
  }
}

}  // namespace

Figure::Figure(std::string name, int width, int height)
    : name_(std::move(name)), width_(width), height_(height) {}

void Figure::data(const std::string& name, const std::vector<std::vector<double>>& rows) {
  std::ostringstream out;
  out << '$' << name << " << EOD\n";
  for (const auto& row : rows) {
    for (const double v : row) out << short_number(v) << ' ';
    out << '\n';
  }
  out << "EOD\n";
  data_ += out.str();
}

void Figure::draw(const std::filesystem::path& directory) const {
  const std::string size = std::to_string(width_) + "," + std::to_string(height_);
  for (const auto& [terminal, extension] :
       {std::pair{"svg font 'Helvetica,11' background rgb 'white'", ".svg"},
        std::pair{"pngcairo font 'Helvetica,9'", ".png"}}) {
    const std::string head = std::string("set terminal ") + terminal + " size " + size +
                             "\nset output " + quoted(directory / (name_ + extension)) + "\n";
    if (!run_gnuplot(head + data_ + script_ + "set output\n")) {
      std::fprintf(stderr, "%s%s: gnuplot could not draw it\n", name_.c_str(), extension);
    }
  }
}

const char* colour_of(std::size_t curve) {
  constexpr const char* colours[] = {"#c03030", "#3060c0", "#30a030", "#a060a0", "#c08000"};
  return colours[curve % std::size(colours)];
}

void write_numbers(const std::filesystem::path& path, const std::vector<std::string>& columns,
                   const std::vector<std::vector<double>>& rows) {
  berth::Table table{"", {columns.begin(), columns.end()}};
  for (const auto& row : rows) {
    auto& line = table.rows.emplace_back().cells;
    for (const double v : row) line.push_back(short_number(v));
  }
  write_file(path, csv_table(table));
}

}  // namespace berth::benchmark
