// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace berth {

/// An error in the user's input: a file, a key, an option. The message states where, what was found
/// and what was expected; programs print it and exit with 2.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace berth
