// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/terminal/raw_terminal.h"

namespace berth {

/// The terminal, key by key, on its second screen; as it was before when this ends.
class SpyTerminal {
 public:
  SpyTerminal();
  ~SpyTerminal();
  SpyTerminal(const SpyTerminal&) = delete;
  SpyTerminal& operator=(const SpyTerminal&) = delete;

  /// The keys pressed since, one after another; empty when there is none.
  std::string next_key();
  void show(const std::string& text) const;
  int rows() const;
  int columns() const;

 private:
  terminal::RawTerminal raw_;
  std::string pressed_;
};

}  // namespace berth
