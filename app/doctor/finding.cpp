// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor/finding.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "app/exit_code.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth {

int print_findings(const std::vector<Finding>& findings) {
  std::size_t width = 16;
  for (const Finding& finding : findings) width = std::max(width, finding.subject.size());
  bool bad = false;
  for (const Finding& finding : findings) {
    const char* mark = finding.state == Finding::State::good      ? "ok     "
                       : finding.state == Finding::State::warning ? "warning"
                                                                  : "BAD    ";
    const std::string gap(width - finding.subject.size(), ' ');
    // A device's description of itself may contain anything.
    print_text(mark + std::string("  ") + finding.subject + gap + " " + finding.found + "\n",
               stdout);
    if (!finding.remedy.empty()) {
      print_text(std::string(9 + width, ' ') + " -> " + finding.remedy + "\n", stdout);
    }
    bad = bad || finding.state == Finding::State::bad;
  }
  return bad ? exit_code::error : exit_code::passed;
}

namespace {

/// Maximum error of a quartz clock, with its temperature and age: 100 ppm, on either side.
constexpr double quartz_ppm = 200;

}  // namespace

Finding clock_finding(const std::string& device, const ClockLine& line, int jumps, Utime bracket,
                      Utime span) {
  Finding finding;
  finding.subject = device + " clock";
  const double ppm = 1e6 * line.drift;
  const double known_ppm = 1e6 * static_cast<double>(bracket) / static_cast<double>(span);
  finding.found = "offset " + fixed(static_cast<double>(line.offset) * 1e-6, 4) + " s +- " +
                  fixed(1e3 * line.sigma_s, 2) + " ms, drift " + fixed(ppm, 0) +
                  " ppm, known within " + fixed(known_ppm, 0);
  if (jumps > 0) {
    finding.state = Finding::State::bad;
    finding.found += "; it jumped " + std::to_string(jumps) + (jumps == 1 ? " time" : " times");
    finding.remedy = "something sets the clock, or what is mapped as the clock is none";
  } else if (std::abs(ppm) - known_ppm > quartz_ppm) {
    finding.state = Finding::State::warning;
    finding.remedy = "more than a quartz's: is it a clock, or a count of cycles that overrun?";
  }
  return finding;
}

}  // namespace berth
