// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/assignment_check.h"

#include <algorithm>
#include <cmath>

namespace berth {
namespace {

constexpr const char* field_names[] = {"$ADDRESS", "$SIZE", "$VAR_NAME", "$MULTIPLY"};

}  // namespace

const SnpxAssignment& AssignmentCheck::assignment() const {
  return map_.assignments[step_ / fields];
}

AssignmentCheck::FieldKind AssignmentCheck::field() const {
  return static_cast<FieldKind>(step_ % fields);
}

void AssignmentCheck::next() {
  if (!map_.bootstrap) return finish(Result::not_offered, "the map has no bootstrap window");
  if (step_ == map_.assignments.size() * fields) return finish(Result::agrees, "");
  const RegisterMap::Bootstrap& window = *map_.bootstrap;
  const bool text = field() == FieldKind::name;
  shown_.assign(RegisterMap::Bootstrap::words, 0);
  put_int32(window.peephole, &shown_[0]);
  put_int32(text ? window.name_words : 2, &shown_[window.size_at]);
  put_text("$SNPX_ASG[" + std::to_string(assignment().slot) + "]." +
               field_names[static_cast<int>(field())],
           std::span(shown_).subspan(window.name_at, window.name_words));
  put_float(text ? -1.0f : 1.0f, &shown_[window.multiply_at]);
  link_.write_registers(window.first, shown_, [self = weak_from_this()](const RegisterAnswer& a) {
    if (const auto check = self.lock()) check->on_shown(a);
  });
}

void AssignmentCheck::on_shown(const RegisterAnswer& answer) {
  if (answer.exception != 0) return finish(Result::not_offered, answer.error);
  if (!answer.ok()) return finish(Result::failed, answer.error);
  const RegisterMap::Bootstrap& window = *map_.bootstrap;
  const auto weak = weak_from_this();
  if (step_ == 0) {  // registers that nobody assigned take any write and read as zeros
    link_.read_registers(window.first, window.words, [weak](const RegisterAnswer& a) {
      if (const auto check = weak.lock()) check->on_window(a);
    });
  } else {
    read_value();
  }
}

void AssignmentCheck::read_value() {
  link_.read_registers(map_.bootstrap->peephole,
                       field() == FieldKind::name ? RegisterMap::Bootstrap::name_words : 2,
                       [weak = weak_from_this()](const RegisterAnswer& a) {
                         if (const auto check = weak.lock()) check->on_value(a);
                       });
}

void AssignmentCheck::on_window(const RegisterAnswer& answer) {
  if (!answer.ok()) return finish(Result::failed, answer.error);
  if (!std::equal(answer.words.begin(), answer.words.end(), shown_.begin())) {
    return finish(Result::not_offered, "registers " + std::to_string(map_.bootstrap->first) +
                                           " and following do not show slot 80");
  }
  read_value();
}

void AssignmentCheck::on_value(const RegisterAnswer& answer) {
  if (!answer.ok()) return finish(Result::failed, answer.error);
  std::string found;
  std::string expected;
  if (field() == FieldKind::name) {
    found = get_text(answer.words);
    expected = assignment().variable;
  } else {
    found = std::to_string(get_int32(answer.words.data()));
    expected = std::to_string(field() == FieldKind::address ? assignment().address
                              : field() == FieldKind::size  ? assignment().size
                                                            : assignment().multiply);
  }
  if (found != expected) {
    return finish(Result::differs, "$SNPX_ASG[" + std::to_string(assignment().slot) + "]." +
                                       field_names[static_cast<int>(field())] + " is '" + found +
                                       "', the map has '" + expected + "'");
  }
  ++step_;
  next();
}

void AssignmentCheck::finish(Result result, const std::string& text) {
  const Done done = std::move(done_);
  if (done) done(result, text);
}

}  // namespace berth
