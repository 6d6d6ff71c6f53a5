// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/condition.h"

#include <algorithm>
#include <regex>

#include "common/core/error.h"
#include "procedures/engine/live_quantity.h"

namespace berth::procedures {
namespace {

using Clause = Condition::Clause;
using Relation = Condition::Relation;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

double word_index(const LiveQuantity& state, const std::string& word) {
  const auto found = std::find(state.words.begin(), state.words.end(), word);
  if (found != state.words.end()) return static_cast<double>(found - state.words.begin());
  std::string words;
  for (const std::string& w : state.words) words += (words.empty() ? "" : ", ") + w;
  throw InputError("found '" + word + "', but " + state.name + " is one of: " + words);
}

Relation relation_of(const std::string& sign) {
  if (sign == "<") return Relation::below;
  if (sign == "<=") return Relation::at_most;
  if (sign == ">") return Relation::above;
  if (sign == ">=") return Relation::at_least;
  return sign == "is" ? Relation::is : Relation::is_not;
}

Clause parse_clause(const std::string& text) {
  static const std::regex grammar(R"(^(\w+)\s*(<=|>=|<|>|\s(?:is not|is)\s)\s*(.+)$)");
  std::smatch match;
  constexpr std::size_t max_length =
      200;  // an expression's matching goes as deep as its text is long
  if (text.size() > max_length || !std::regex_match(text, match, grammar)) {
    throw InputError("found '" + text +
                     "', expected a condition such as 'estimated_range < 4 m' or 'estimate is ok'");
  }
  Clause clause;
  clause.quantity = live_quantity_named(match[1]);
  if (clause.quantity == nullptr) throw InputError(unknown_live_quantity(match[1]));
  const LiveQuantity& quantity = *clause.quantity;
  clause.relation = relation_of(trimmed(match[2]));
  const bool states = clause.relation == Relation::is || clause.relation == Relation::is_not;
  if (states != quantity.is_state()) {
    throw InputError("found '" + text + "', but " + quantity.name +
                     (states ? " is a quantity: expected <, <=, > or >="
                             : " is a state: expected 'is' or 'is not'"));
  }
  const std::string value = trimmed(match[3]);
  clause.value = states ? word_index(quantity, value) : parse_quantity(value, quantity.dimension);
  return clause;
}

/// Splits at a word that stands by itself.
std::vector<std::string> split(const std::string& text, const std::string& word) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  const std::string separator = " " + word + " ";
  for (auto at = text.find(separator); at != std::string::npos; at = text.find(separator, from)) {
    parts.push_back(trimmed(text.substr(from, at - from)));
    from = at + separator.size();
  }
  parts.push_back(trimmed(text.substr(from)));
  return parts;
}

bool holds(const Clause& clause, double value) {
  switch (clause.relation) {
    case Relation::below:
      return value < clause.value;
    case Relation::at_most:
      return value <= clause.value;
    case Relation::above:
      return value > clause.value;
    case Relation::at_least:
      return value >= clause.value;
    case Relation::is:
      return value == clause.value;
    case Relation::is_not:
      return value >= 0 && value != clause.value;  // an unknown state meets neither relation
  }
  return false;
}

}  // namespace

bool Condition::met(const RunMessages& live, std::string& found) const {
  found.clear();
  bool all = true;
  bool one = false;
  for (const Clause& clause : clauses) {
    const double value = clause.quantity->value(live);
    const bool so = holds(clause, value);
    all = all && so;
    one = one || so;
    found += (found.empty() ? "" : ", ") + clause.quantity->name + " ";
    found += (clause.quantity->is_state() ? "is " : "") + clause.quantity->text(value);
  }
  return any ? one : all;
}

Condition parse_condition(const std::string& text) {
  Condition condition;
  condition.text = trimmed(text);
  std::string rest = condition.text;
  if (const auto at = rest.rfind(" for "); at != std::string::npos) {
    condition.duration = parse_quantity(rest.substr(at + 5), Dimension::time);
    rest = trimmed(rest.substr(0, at));
  }
  const auto by_and = split(rest, "and");
  const auto by_or = split(rest, "or");
  if (by_and.size() > 1 && by_or.size() > 1) {
    throw InputError("found '" + condition.text + "', expected either 'and' or 'or', not both");
  }
  condition.any = by_or.size() > 1;
  for (const std::string& part : condition.any ? by_or : by_and) {
    condition.clauses.push_back(parse_clause(part));
  }
  return condition;
}

}  // namespace berth::procedures
