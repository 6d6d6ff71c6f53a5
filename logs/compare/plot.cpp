// SPDX-License-Identifier: BSD-3-Clause
#include "logs/compare/plot.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <sstream>
#include <string>

namespace berth::logs {
namespace {

struct ClosePipe {
  void operator()(std::FILE* pipe) const { pclose(pipe); }
};

void put_line(std::ostream& out, double time, const std::array<double, 6>& values) {
  out << time;
  for (const double v : values) out << ' ' << v;
  out << '\n';
}

std::string truth_block(const RunRecord& record, Utime start) {
  constexpr Utime period = 50 * millisecond;
  std::ostringstream out;
  Utime last = std::numeric_limits<Utime>::min() / 2;
  for (const TruthSample& sample : record.truth().samples()) {
    if (sample.utime - last < period) continue;
    last = sample.utime;
    put_line(out, seconds(sample.utime - start), xyzwpr_from_pose(sample.pose));
  }
  return out.str();
}

std::string estimate_block(const RunRecord& record, Utime start) {
  std::ostringstream out;
  for (const EstimateSample& e : record.estimates()) {
    if (e.ok()) put_line(out, seconds(e.utime - start), xyzwpr_from_pose(e.pose));
  }
  return out.str();
}

std::string error_block(const Measurer& measurer, Utime start) {
  std::ostringstream out;
  for (const ComparedEstimate& c : measurer.compared()) {
    std::array<double, 6> error;
    for (std::size_t i = 0; i < 3; ++i) {
      error[i] = 1e3 * c.error(static_cast<Eigen::Index>(i));
      error[i + 3] = degrees(c.error(static_cast<Eigen::Index>(i + 3)));
    }
    put_line(out, seconds(c.estimate.utime - start), error);
  }
  return out.str();
}

std::string data_block(const char* name, const std::string& lines) {
  return std::string("$") + name + " << EOD\n" + lines + "EOD\n";
}

std::string phase_marks(const RunRecord& record, Utime start) {
  std::ostringstream out;
  for (const Phase& phase : record.phases()) {
    if (phase.name == whole_run || phase.name == teardown_phase) continue;
    const double at = seconds(phase.start() - start);
    out << "set arrow from " << at << ", graph 0 to " << at
        << ", graph 1 nohead lc rgb '#c0c0c0' dt 2\n";
    std::string name;
    for (const char c : phase.name) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == ' ' || c == '-') name += c;
      if (c == '_') name += ' ';
    }
    out << "set label '" << name << "' at " << at
        << ", graph 0.97 left offset 0.3,0 font ',8' tc rgb '#808080' rotate by -90\n";
  }
  return out.str();
}

/// Empty when there is nothing to draw.
std::string script_for(const RunRecord& record, const std::filesystem::path& svg) {
  const Measurer measurer(record, {});
  const auto run = record.phase(whole_run);
  const Utime start = run                          ? run->start()
                      : record.estimates().empty() ? 0
                                                   : record.estimates().front().utime;
  std::string name;
  for (const char c : svg.string()) name += c == '\'' ? std::string("''") : std::string(1, c);
  const std::string truth = truth_block(record, start);
  const std::string estimate = estimate_block(record, start);
  const std::string error = error_block(measurer, start);
  if (truth.empty() && estimate.empty()) return {};
  std::ostringstream out;
  out << "set terminal svg size 1100,1500 font 'Helvetica,11' background rgb 'white'\n"
      << "set output '" << name << "'\n"
      << data_block("truth", truth) << data_block("estimate", estimate)
      << data_block("error", error)
      << "set multiplot layout 4,2\nset grid lc rgb '#e0e0e0'\nset xlabel 's'\n"
      << "set key top right\n"
      << phase_marks(record, start);
  if (run) {
    out << "set xrange [0:" << std::max(1e-3, seconds(run->end() - start)) << "]\n";
  }
  // gnuplot refuses to draw what is empty.
  constexpr const char* axes[] = {"x, mm", "w, deg", "y, mm", "p, deg", "z, mm", "r, deg"};
  constexpr int columns[] = {2, 5, 3, 6, 4, 7};
  for (int i = 0; i < 6; ++i) {
    out << "set ylabel '" << axes[i] << "'\nplot ";
    if (!truth.empty()) {
      out << "$truth using 1:" << columns[i] << " with lines lc rgb '#888888' title 'truth'";
    }
    if (!estimate.empty()) {
      out << (truth.empty() ? "" : ", ") << "$estimate using 1:" << columns[i]
          << " with points pt 7 ps 0.3 lc rgb '#0060c0' title 'estimate'";
    }
    out << '\n';
  }
  const auto errors = [&out](const char* unit, int first, const char* names[3]) {
    constexpr const char* colours[] = {"#c03030", "#30a030", "#3060c0"};
    out << "set ylabel '" << unit << "'\nplot ";
    for (int i = 0; i < 3; ++i) {
      out << "$error using 1:" << first + i << " with linespoints pt 7 ps 0.25 lc rgb '"
          << colours[i] << "' title '" << names[i] << "'" << (i < 2 ? ", " : "\n");
    }
  };
  const char* position[] = {"x", "y", "z"};
  const char* attitude[] = {"about x", "about y", "about z"};
  if (!error.empty()) {
    errors("position error, mm", 2, position);
    errors("attitude error, deg", 5, attitude);
  }
  out << "unset multiplot\nset output\n";
  return out.str();
}

}  // namespace

bool write_plot(const RunRecord& record, const std::filesystem::path& svg) {
  const std::string script = script_for(record, svg);
  if (script.empty()) return false;
  if (std::system("command -v gnuplot >/dev/null 2>&1") != 0) return false;
  std::unique_ptr<std::FILE, ClosePipe> pipe(popen("gnuplot >/dev/null 2>&1", "w"));
  if (pipe == nullptr) return false;
  if (std::fwrite(script.data(), 1, script.size(), pipe.get()) != script.size()) return false;
  return pclose(pipe.release()) == 0 && std::filesystem::exists(svg);
}

}  // namespace berth::logs
