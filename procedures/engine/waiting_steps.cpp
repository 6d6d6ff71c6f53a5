// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <berth/event_t.hpp>
#include <cmath>

#include "common/core/text.h"
#include "procedures/engine/step_runner.h"

namespace berth::procedures {
namespace {

class WaitRunner final : public StepRunner {
 public:
  explicit WaitRunner(double duration) : duration_(duration) {}

  void begin(Bench&, Utime) override {}

  StepResult poll(Bench&, Utime, Utime active) override {
    detail_ = fixed(seconds(active), 0) + " of " + fixed(duration_, 0) + " s";
    return seconds(active) >= duration_ ? StepResult::passed : StepResult::running;
  }

 private:
  double duration_;
};

class WaitUntilRunner final : public StepRunner {
 public:
  explicit WaitUntilRunner(Condition condition) : condition_(std::move(condition)) {}

  void begin(Bench&, Utime) override {}

  StepResult poll(Bench& bench, Utime now, Utime) override {
    std::string found;
    if (!condition_.met(bench.live, found)) {
      since_ = 0;
      detail_ = found + "; expected: " + condition_.text;
      return StepResult::running;
    }
    if (since_ == 0) since_ = now;
    detail_ = found;
    return seconds(now - since_) >= condition_.duration ? StepResult::passed : StepResult::running;
  }

 private:
  Condition condition_;
  Utime since_ = 0;
};

class PromptRunner final : public StepRunner {
 public:
  explicit PromptRunner(Prompt prompt) : prompt_(std::move(prompt)) {}

  void begin(Bench& bench, Utime) override {
    bench.actions.event(event_t::NOTICE, "prompt", prompt_.text);
  }

  StepResult poll(Bench&, Utime, Utime) override {
    if (answer_.empty()) return StepResult::running;
    detail_ = "answer: " + answer_ + source_;
    const auto& good = prompt_.go_on;
    const bool goes_on = good.empty() || std::find(good.begin(), good.end(), answer_) != good.end();
    return goes_on ? StepResult::passed : StepResult::failed;
  }

  const Prompt* prompt() const override { return answer_.empty() ? &prompt_ : nullptr; }

  void answer(const std::string& text, const std::string& source) override {
    answer_ = text;
    source_ = " (" + source + ")";
  }

 private:
  Prompt prompt_;
  std::string answer_;
  std::string source_;
};

class AnnotateRunner final : public StepRunner {
 public:
  explicit AnnotateRunner(std::string text) : text_(std::move(text)) {}

  void begin(Bench& bench, Utime) override {
    bench.actions.event(event_t::NOTICE, "annotation", text_);
  }
  StepResult poll(Bench&, Utime, Utime) override { return StepResult::passed; }

 private:
  std::string text_;
};

class RecordRunner final : public StepRunner {
 public:
  explicit RecordRunner(Record record) : record_(std::move(record)) {}

  void begin(Bench&, Utime) override {}

  StepResult poll(Bench& bench, Utime, Utime) override {
    const double value = record_.quantity->value(bench.live);
    detail_ = record_.name + " = " + record_.quantity->text(value);
    if (std::isnan(value)) return StepResult::failed;
    bench.actions.event(event_t::NOTICE, "recorded", detail_);
    return StepResult::passed;
  }

 private:
  Record record_;
};

}  // namespace

std::unique_ptr<StepRunner> make(const Wait& wait) {
  return std::make_unique<WaitRunner>(wait.duration);
}
std::unique_ptr<StepRunner> make(const WaitUntil& wait) {
  return std::make_unique<WaitUntilRunner>(wait.condition);
}
std::unique_ptr<StepRunner> make(const Prompt& prompt) {
  return std::make_unique<PromptRunner>(prompt);
}
std::unique_ptr<StepRunner> make(const Annotate& annotate) {
  return std::make_unique<AnnotateRunner>(annotate.text);
}
std::unique_ptr<StepRunner> make(const Record& record) {
  return std::make_unique<RecordRunner>(record);
}

}  // namespace berth::procedures
