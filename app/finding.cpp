// SPDX-License-Identifier: BSD-3-Clause
#include "app/finding.h"

#include <algorithm>
#include <cstdio>

#include "app/exit_code.h"
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
    // What a device says of itself may be anything.
    print_text(mark + std::string("  ") + finding.subject + gap + " " + finding.found + "\n",
               stdout);
    if (!finding.remedy.empty()) {
      print_text(std::string(9 + width, ' ') + " -> " + finding.remedy + "\n", stdout);
    }
    bad = bad || finding.state == Finding::State::bad;
  }
  return bad ? exit_code::error : exit_code::passed;
}

}  // namespace berth
