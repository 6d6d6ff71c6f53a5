// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>

#include "app/console/server/board.h"
#include "app/console/view/section.h"

namespace berth::console {

/// Writes the sections of a view to the board.
class BoardSink : public Sink {
 public:
  explicit BoardSink(Board& board) : board_(board) {}
  void at(Utime utime) override { board_.at(utime); }
  void set(const std::string& section, std::string json) override {
    board_.set(section, std::move(json));
  }
  void add(const std::string& list, std::string json) override {
    board_.add(list, std::move(json));
  }
  void reset(const std::string& list) override { board_.reset(list); }

 private:
  Board& board_;
};

}  // namespace berth::console
