// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/step_options.h"

#include <algorithm>
#include <regex>

#include "common/core/error.h"

namespace berth::procedures {

namespace {

const std::vector<std::string>& when_lost_words() {
  static const std::vector<std::string> words = {"fail", "skip", "ignore"};
  return words;
}

}  // namespace

OnFailure read_on_failure(Config& step, OnFailure default_value) {
  if (!step.has("on_failure")) return default_value;
  const std::string text = step.text("on_failure");
  static const std::regex grammar(
      R"(^(?:retry (\d{1,2}) times?)?(?:(, then |^)(abort|continue|hold))?$)");
  std::smatch match;
  if (text.empty() || !std::regex_match(text, match, grammar)) {
    throw step.error("on_failure", "found '" + text +
                                       "', expected 'abort', 'continue', 'hold', 'retry 3 times' "
                                       "or 'retry 3 times, then hold'");
  }
  OnFailure result;
  if (match[1].matched) result.retries = std::stoi(match[1]);
  if (match[3] == "continue") result.then = OnFailure::Then::go_on;
  if (match[3] == "hold") result.then = OnFailure::Then::hold;
  return result;
}

std::optional<WhenLost> read_when_lost(Config& step) {
  if (!step.has("when_lost")) return std::nullopt;
  const std::string word = step.choice("when_lost", when_lost_words());
  if (word == "skip") return WhenLost::skip;
  return word == "ignore" ? WhenLost::ignore : WhenLost::fail;
}

std::optional<Condition> read_if(Config& step) {
  if (!step.has("if")) return std::nullopt;
  try {
    Condition condition = parse_condition(step.text("if"));
    if (condition.duration > 0) {
      throw InputError("found '" + condition.text + "', expected no 'for': it is looked at once");
    }
    return condition;
  } catch (const InputError& e) {
    throw step.error("if", e.what());
  }
}

const std::vector<KeyInfo>& step_keys() {
  static const std::vector<KeyInfo> keys = {
      {"name", Kind::text, false, "the verb", "for a person"},
      {"phase", Kind::text, false, "the verb", "label under which its stretch of time is judged"},
      {"timeout", Kind::time, false, "the verb's", "after which it has run out of time"},
      {"if", Kind::condition, false, "always", "skipped when it is not so as its turn comes"},
      {"on_failure", Kind::text, false, "abort",
       "abort, continue, hold, 'retry N times', or 'retry N times, then continue' (or hold)"},
      {"when_lost", Kind::words, false, "fail",
       "when the target is lost meanwhile: fail ends the run, skip this step, ignore neither",
       when_lost_words()},
  };
  return keys;
}

const std::vector<std::string>& frozen_arms() {
  static const std::vector<std::string> words = {"none", "replica", "sensor"};
  return words;
}

int frozen_arm_of(const std::string& word) {
  const auto& words = frozen_arms();
  const auto found = std::find(words.begin(), words.end(), word);
  return found == words.end() ? -1 : static_cast<int>(found - words.begin());
}

}  // namespace berth::procedures
