// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "evaluation/compare/comparison.h"

namespace berth::evaluation {

/// One test suite of a JUnit report. Each row of its tables is a test case with the row's name,
/// duration and status: inconclusive is skipped; the message are the row's cells and its note.
struct JunitSuite {
  std::string name;
  double time_s = 0;
  std::vector<std::pair<std::string, std::string>> properties;
  std::vector<std::pair<std::string, Table>> tables;  ///< class name and tests
  std::string output;                                 ///< system-out
};

/// A run as a test suite named after its procedure: one case per step and per criterion. A
/// criterion that failed is a failure, one that is inconclusive is skipped; a step that went wrong
/// is an error (of the rig), one that did not run is skipped. A verdict that no case explains has
/// one of its own.
JunitSuite junit_suite_of(const Comparison& comparison);

/// The report as continuous integration reads it (the schema of Ant and Jenkins). Bytes that XML
/// cannot hold are shown as '?'.
std::string junit_xml(const std::vector<JunitSuite>& suites);

}  // namespace berth::evaluation
