// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/arm/register_map.h"
#include "drivers/registers/register_link.h"

namespace berth {

/// Reads a controller's assignments back through slot 80 and compares them with the map: each
/// entry's four fields are shown at the peephole, one after another.
class AssignmentCheck : public std::enable_shared_from_this<AssignmentCheck> {
 public:
  enum class Result {
    agrees,
    differs,      ///< the text names slot, field and both values
    not_offered,  ///< the controller has no bootstrap window: nothing was compared
    failed,       ///< no connection; the text says why
  };
  using Done = std::function<void(Result, const std::string& text)>;

  /// link and map must outlive it; dropped by its holder, it calls nothing any more.
  AssignmentCheck(RegisterLink& link, const RegisterMap& map, Done done)
      : link_(link), map_(map), done_(std::move(done)) {}
  void start() { next(); }

 private:
  enum class FieldKind { address, size, name, multiply };
  static constexpr int fields = 4;

  void next();
  void on_shown(const RegisterAnswer& answer);
  void on_window(const RegisterAnswer& answer);
  void read_value();
  void on_value(const RegisterAnswer& answer);
  void finish(Result result, const std::string& text);
  const SnpxAssignment& assignment() const;
  FieldKind field() const;

  RegisterLink& link_;
  const RegisterMap& map_;
  Done done_;
  std::size_t step_ = 0;  // assignment * 4 + field
  std::vector<Word> shown_;
};

}  // namespace berth
