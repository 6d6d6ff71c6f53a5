// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth {

struct ProgramOutput {
  int exit_code = 0;   ///< 128 + signal when it was killed
  std::string text;    ///< its standard output
  std::string errors;  ///< its standard error
};

/// Runs a program of the PATH, without a shell, until it ends.
/// @param arguments the first is the program
/// @throws InputError when it is not found or cannot be started.
ProgramOutput run_program(const std::vector<std::string>& arguments);

}  // namespace berth
