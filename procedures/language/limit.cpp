// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/limit.h"

#include <limits>

namespace berth::procedures {

const std::vector<KeyInfo>& limit_keys() {
  static const std::vector<KeyInfo> keys = {
      {"name", Kind::text, true, "", "for a person"},
      {"watch", Kind::live, true, "", "the live quantity"},
      {"min", Kind::quantity, false, "none", "broken below it"},
      {"max", Kind::quantity, false, "none", "broken above it"},
      {"phase", Kind::text, false, "all steps", "watched in this phase alone"},
      {"for", Kind::time, false, "0 s", "how long it must be broken without a break"},
      {"then",
       Kind::words,
       false,
       "fail",
       "fail: the run has failed; abort: the run is aborted; hold: held for the operator",
       {"fail", "abort", "hold"}},
  };
  return keys;
}

std::vector<Limit> read_limits(Config& procedure) {
  std::vector<Limit> limits;
  for (Config& config : procedure.sections("limits")) {
    Limit limit;
    limit.file = config.file();
    limit.line = config.line();
    limit.name = config.text("name");
    const std::string watch = config.text("watch");
    limit.quantity = live_quantity_named(watch);
    if (limit.quantity == nullptr) throw config.error("watch", unknown_live_quantity(watch));
    if (limit.quantity->is_state()) {
      throw config.error("watch", "'" + watch + "' is a state, and a limit needs a quantity");
    }
    limit.lower = -std::numeric_limits<double>::infinity();
    limit.upper = std::numeric_limits<double>::infinity();
    config.optional("min", limit.quantity->dimension, limit.lower);
    config.optional("max", limit.quantity->dimension, limit.upper);
    if (!config.has("min") && !config.has("max")) {
      throw config.error("name", "limit '" + limit.name + "' needs 'min' or 'max'");
    }
    if (limit.lower > limit.upper) throw config.error("min", "is greater than 'max'");
    config.optional("phase", limit.phase);
    config.optional("for", Dimension::time, limit.duration);
    if (config.has("then")) {
      const std::string then = config.choice("then", {"fail", "abort", "hold"});
      limit.then = then == "fail"    ? Limit::Then::fail
                   : then == "abort" ? Limit::Then::abort
                                     : Limit::Then::hold;
    }
    config.finish();
    limits.push_back(limit);
  }
  return limits;
}

}  // namespace berth::procedures
