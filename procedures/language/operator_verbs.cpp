// SPDX-License-Identifier: BSD-3-Clause
// Verbs for waiting, prompts and records.
#include <algorithm>

#include "procedures/language/verbs.h"

namespace berth::procedures {
namespace {

Read read_wait(Config& step) {
  const double duration = step.quantity("wait", Dimension::time, above(0));
  return {Wait{duration}, duration + 30};
}

Read read_wait_until(Config& step) {
  try {
    return {WaitUntil{parse_condition(step.text("wait_until"))}, 60};
  } catch (const InputError& e) {
    throw step.error("wait_until", e.what());
  }
}

constexpr double prompt_timeout = 600;

Read read_prompt_text(Config& step) {
  return {Prompt{step.text("prompt"), {}, {}, ""}, prompt_timeout};
}

Read read_prompt(Config& config) {
  Prompt prompt;
  prompt.text = config.text("text");
  if (config.has("choices")) prompt.choices = config.texts("choices");
  if (config.has("go_on")) prompt.go_on = config.texts("go_on");
  config.optional("default", prompt.default_value);
  const auto among_choices = [&](const std::string& key, const std::string& answer) {
    const auto& known = prompt.choices;
    if (known.empty() || std::find(known.begin(), known.end(), answer) != known.end()) return;
    throw config.error(key, "found '" + answer + "', expected one of the choices");
  };
  for (const std::string& answer : prompt.go_on) among_choices("go_on", answer);
  if (!prompt.default_value.empty()) among_choices("default", prompt.default_value);
  return {std::move(prompt), prompt_timeout};
}

Read read_annotate(Config& step) { return {Annotate{step.text("annotate")}, 10}; }

Record record_of(Config& config, const std::string& key) {
  const std::string name = config.text(key);
  const LiveQuantity* quantity = live_quantity_named(name);
  if (quantity == nullptr) throw config.error(key, unknown_live_quantity(name));
  return {name, quantity};
}

Read read_record_value(Config& step) { return {record_of(step, "record"), 10}; }

Read read_record(Config& config) {
  Record record = record_of(config, "value");
  config.optional("name", record.name);
  return {std::move(record), 10};
}

}  // namespace

std::vector<VerbInfo> operator_verbs() {
  return {
      {"wait", "lets time pass", "its time and 30 s", {}, nullptr, Kind::time, read_wait},
      {"wait_until",
       "until a condition is met",
       "60 s",
       {},
       nullptr,
       Kind::condition,
       read_wait_until},
      {"prompt",
       "prompts the operator; with a text alone any answer will do",
       "10 min",
       {{"text", Kind::text, true, "", "the question"},
        {"choices", Kind::texts, false, "any text", "answers that are understood"},
        {"go_on", Kind::texts, false, "all", "answers with which the step has passed"},
        {"default", Kind::text, false, "none: TIMEOUT", "the answer when none comes in time"}},
       read_prompt,
       Kind::text,
       read_prompt_text},
      {"annotate", "leaves a remark in the log", "10 s", {}, nullptr, Kind::text, read_annotate},
      {"record",
       "leaves the present value of a live quantity in the log",
       "10 s",
       {{"value", Kind::live, true, "", "the live quantity"},
        {"name", Kind::text, false, "the quantity's", "under which it is found"}},
       read_record,
       Kind::live,
       read_record_value},
  };
}

}  // namespace berth::procedures
