// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/limit_watch.h"

#include <cmath>
#include <limits>

namespace berth::procedures {
namespace {

std::string text_of(const Limit& limit, double value) {
  const LiveQuantity& quantity = *limit.quantity;
  const bool below = value < limit.lower;
  return "limit '" + limit.name + "': " + quantity.name + " " + quantity.text(value) + ", not " +
         (below ? "below " : "above ") + quantity.text(below ? limit.lower : limit.upper);
}

}  // namespace

LimitWatch::LimitWatch(std::vector<Limit> limits) {
  for (Limit& limit : limits) {
    criterion_result_t result{};
    result.name = limit.name;
    result.measurement = limit.quantity->name;
    result.phase = limit.phase;
    result.unit = limit.quantity->unit;
    result.lower_limit = limit.lower / limit.quantity->unit_si;
    result.upper_limit = limit.upper / limit.quantity->unit_si;
    result.value = std::numeric_limits<double>::quiet_NaN();
    results_.push_back(result);
    watched_.push_back({std::move(limit)});
  }
}

std::optional<LimitWatch::Broken> LimitWatch::look(const RunMessages& live, int step,
                                                   const std::string& phase) {
  std::optional<Broken> gravest;
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    Watched& watched = watched_[i];
    criterion_result_t& result = results_[i];
    const Limit& limit = watched.limit;
    const bool applies = step >= limit.first_step && step <= limit.last_step &&
                         (limit.phase.empty() || limit.phase == phase);
    const double value =
        applies ? limit.quantity->value(live) : std::numeric_limits<double>::quiet_NaN();
    // An unknown quantity breaks no limit: criteria and steps can require that it is known.
    const bool outside = value < limit.lower || value > limit.upper;
    result.value = value / limit.quantity->unit_si;
    if (!std::isnan(value)) ++result.samples;
    if (!outside) {
      watched.broken_since = 0;
      watched.broken = false;
      if (!std::isnan(value) && result.result == criterion_result_t::PENDING) {
        result.result = criterion_result_t::PASSED;
      }
      continue;
    }
    if (watched.broken_since == 0) watched.broken_since = live.now();
    if (watched.broken || seconds(live.now() - watched.broken_since) < limit.duration) continue;
    watched.broken = true;
    result.result = criterion_result_t::FAILED;
    result.reason = text_of(limit, value);
    if (!gravest || gravest->then == Limit::Then::hold) gravest = {limit.then, result.reason};
  }
  return gravest;
}

std::string LimitWatch::broken_now() const {
  std::string text;
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    if (watched_[i].broken) text += (text.empty() ? "" : "; ") + results_[i].reason;
  }
  return text;
}

}  // namespace berth::procedures
