// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/blocks.h"

#include <algorithm>
#include <filesystem>

#include "common/core/error.h"
#include "common/core/text.h"
#include "common/core/yaml_text.h"
#include "procedures/language/procedure.h"
#include "procedures/language/source.h"
#include "procedures/language/step_options.h"
#include "procedures/language/sweep.h"

namespace berth::procedures {
namespace {

namespace fs = std::filesystem;

/// Context of a step.
struct Surroundings {
  int depth = 0;
  std::string label;  // of the blocks: "yaw 10 deg, 2 of 3"
  std::string phase;
  OnFailure on_failure;
  std::optional<WhenLost> when_lost;
};

std::string appended(const std::string& a, const std::string& b) {
  return a + (a.empty() || b.empty() ? "" : ", ") + b;
}

std::string list_of_verbs() {
  std::string list;
  for (const auto* table : {&verbs(), &blocks()}) {
    for (const VerbInfo& verb : *table) list = appended(list, verb.name);
  }
  return list;
}

const VerbInfo* find_in(const std::vector<VerbInfo>& table, const std::string& name) {
  const auto found = std::find_if(table.begin(), table.end(),
                                  [&name](const VerbInfo& v) { return v.name == name; });
  return found == table.end() ? nullptr : &*found;
}

bool is_step_key(const std::string& key) {
  const auto same = [&key](const KeyInfo& info) { return info.key == key; };
  return std::any_of(step_keys().begin(), step_keys().end(), same);
}

/// The one thing that a step does.
const VerbInfo& verb_of(const Config& step) {
  const VerbInfo* verb = nullptr;
  for (const std::string& key : step.keys()) {
    const VerbInfo* found = find_in(verbs(), key);
    if (found == nullptr) found = find_in(blocks(), key);
    if (found == nullptr) {
      if (is_step_key(key)) continue;
      throw step.error(key, "is no step; steps are: " + list_of_verbs());
    }
    if (verb != nullptr) {
      throw step.error(key, "a step does one thing, and this one has '" + verb->name + "' already");
    }
    verb = found;
  }
  if (verb == nullptr) {
    throw step.error(step.keys().empty() ? "steps" : step.keys().front(),
                     "this step does nothing; steps are: " + list_of_verbs());
  }
  return *verb;
}

class Unroller {
 public:
  Unroller(const Source& source, Library& library, Unrolled& result)
      : source_(source), library_(library), result_(result) {}

  void list(Config container, const std::string& key, const Surroundings& around) {
    const auto steps = container.sections(key);
    if (steps.empty()) throw container.error(key, "expected at least one step");
    for (const Config& config : steps) step(config, around);
  }

 private:
  void step(Config config, const Surroundings& around) {
    const VerbInfo& verb = verb_of(config);
    const std::size_t first = result_.steps.size();
    const auto condition = read_if(config);
    Surroundings inside = around;
    inside.on_failure = read_on_failure(config, around.on_failure);
    if (const auto when_lost = read_when_lost(config)) inside.when_lost = when_lost;
    config.optional("phase", inside.phase);
    if (inside.phase == evaluation::whole_run || inside.phase == evaluation::teardown_phase) {
      throw config.error("phase", "'" + inside.phase + "' is a phase of every procedure's own");
    }
    if (find_in(blocks(), verb.name) == nullptr) {
      simple(config, verb, inside);
    } else {
      ++inside.depth;
      if (config.has("name")) inside.label = appended(around.label, config.text("name"));
      if (verb.name == "repeat") repeat(config, inside);
      if (verb.name == "sweep") sweep(config, inside);
      if (verb.name == "call") call(config, inside);
      if (verb.name == "calibrate") calibrate(config, inside);
      config.finish();
    }
    if (condition && first < result_.steps.size()) {
      auto& gates = result_.steps[first].gates;
      gates.insert(gates.begin(), {*condition, static_cast<int>(result_.steps.size() - first)});
    }
  }

  void add(Step step, const Config& config) {
    if (static_cast<int>(result_.steps.size()) >= max_steps) {
      throw InputError(config.file() + ":" + std::to_string(config.line()) + ": more than " +
                       std::to_string(max_steps) + " steps");
    }
    step.file = source_.file;
    step.line = config.line();
    result_.steps.push_back(std::move(step));
  }

  void simple(Config& config, const VerbInfo& verb, const Surroundings& around) {
    refuse_open_references(config.node(), source_.file);
    give_attached(config, source_, library_);
    Read read = read_verb(verb, config);
    keep_attached(config, source_, library_);
    Step step;
    step.verb = std::move(read.verb);
    step.timeout = read.timeout;
    step.name = verb.name + (around.label.empty() ? "" : " (" + around.label + ")");
    step.phase = around.phase.empty() ? verb.name : around.phase;
    step.on_failure = around.on_failure;
    step.when_lost = around.when_lost.value_or(WhenLost::fail);
    step.depth = around.depth;
    config.optional("name", step.name);
    config.optional("timeout", Dimension::time, step.timeout, above(0));
    config.finish();
    add(std::move(step), config);
  }

  void repeat(Config& config, const Surroundings& around) {
    Config block = config.section("repeat");
    const std::int64_t times = block.integer("times", within(1, max_steps));
    block.raw("steps");
    finish_keys(block, find_in(blocks(), "repeat")->keys, "repeat");
    for (std::int64_t i = 1; i <= times; ++i) {
      Surroundings inside = around;
      inside.label = appended(around.label, std::to_string(i) + " of " + std::to_string(times));
      list(block, "steps", inside);
    }
  }

  void sweep(Config& config, const Surroundings& around) {
    Config block = config.section("sweep");
    block.raw("steps");
    sweep_axis(read_axes(block), 0, block, around);
  }

  void sweep_axis(const std::vector<SweepAxis>& axes, std::size_t axis, const Config& block,
                  const Surroundings& around) {
    if (axis == axes.size()) return list(block, "steps", around);
    for (std::size_t i = 0; i < axes[axis].values.size(); ++i) {
      const YamlNode& value = axes[axis].values[i];
      Surroundings inside = around;
      inside.label = appended(
          around.label,
          axes[axis].name + " " + (value.is_list() ? "#" + std::to_string(i + 1) : value.text()));
      sweep_axis(axes, axis + 1, block.holding(fill(block.node(), {{axes[axis].name, value}})),
                 inside);
    }
  }

  void call(Config& config, const Surroundings& around) {
    refuse_open_references(config.node(), source_.file);
    std::string written;
    Overrides with;
    if (config.raw("call").is_text()) {
      written = config.text("call");
    } else {
      Config block = config.section("call");
      written = block.text("procedure");
      if (block.has("with")) {
        Config values = block.section("with");
        for (const std::string& name : values.keys()) with[name] = plain_text(values.raw(name));
      }
      finish_keys(block, find_in(blocks(), "call")->keys, "call");
    }
    const fs::path folder = fs::path(source_.name).parent_path();
    const std::string name = (folder / written).lexically_normal().generic_string();
    auto callers = source_.callers;
    callers.push_back(source_.name);
    if (std::find(callers.begin(), callers.end(), name) != callers.end()) {
      throw config.error("call", "found '" + written +
                                     "', which is running already: it would "
                                     "call itself without end");
    }
    const std::string file = library_.file(name);
    const std::string* text = nullptr;
    try {
      text = &library_.text(name);
    } catch (const InputError& e) {
      throw config.error("call", e.what());
    }
    try {
      Source source = make_source(*text, file, name, with);
      source.callers = callers;
      const int first = static_cast<int>(result_.steps.size());
      Config top(source.tree, source.file);
      check_top_level(top);
      auto limits = read_limits(top);
      Unroller(source, library_, result_).list(top, "steps", around);
      for (Limit& limit : limits) {
        limit.first_step = first;
        limit.last_step = static_cast<int>(result_.steps.size()) - 1;
        result_.limits.push_back(limit);
      }
    } catch (const InputError& e) {
      const std::string what = e.what();
      const bool names_place = what.find(file + ":") == 0;
      if (!names_place) throw config.error("call", what);
      throw InputError(what + "\n  called from " + source_.file + ":" +
                       std::to_string(config.line()));
    }
  }

  void calibrate(Config& config, const Surroundings& around) {
    refuse_open_references(config.node(), source_.file);
    Config block = config.section("calibrate");
    Move move;
    Dwell dwell{20, 1};
    move.speed = block.quantity("speed", Dimension::speed, above(0));
    move.angular_speed = radians(10);
    block.optional("turn", Dimension::angular_speed, move.angular_speed, above(0));
    block.optional("estimates", dwell.estimates, at_least(1));
    block.optional("settle", Dimension::time, dwell.settle, at_least(0));
    Track track;
    block.optional("returns", track.returns, at_least(0));
    const Condition seen = parse_condition("estimate is ok");
    const Condition not_seen = parse_condition("estimate is not ok");
    const auto poses = read_poses(block, "poses");
    std::vector<int> frozen(poses.size(), move.frozen_arm);
    if (block.has("frozen")) {
      const auto words = block.texts("frozen");
      if (words.size() != poses.size()) {
        throw block.error("frozen", "found " + std::to_string(words.size()) +
                                        " arms, expected one for each of the " +
                                        std::to_string(poses.size()) + " poses");
      }
      for (std::size_t i = 0; i < words.size(); ++i) {
        frozen[i] = frozen_arm_of(words[i]);
        if (frozen[i] < 0) {
          throw block.error("frozen", "found '" + words[i] +
                                          "', expected one of: " + berth::joined(frozen_arms()));
        }
      }
    }
    finish_keys(block, find_in(blocks(), "calibrate")->keys, "calibrate");
    const std::string phase = around.phase.empty() ? "calibrate" : around.phase;
    double timeout = 180;
    config.optional("timeout", Dimension::time, timeout);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const std::string which = appended(
          around.label, "pose " + std::to_string(i + 1) + " of " + std::to_string(poses.size()));
      move.to = poses[i];
      move.frozen_arm = frozen[i];
      Step step;
      step.depth = around.depth;
      step.on_failure = around.on_failure;
      step.timeout = timeout;
      step.verb = move;
      step.name = "move (" + which + ")";
      step.phase = phase + " motion";
      step.when_lost = around.when_lost.value_or(WhenLost::ignore);
      add(step, config);
      // If lost during the motion: the commanded pose is known.
      track.from = poses[i];
      step.verb = track;
      step.name = "find (" + which + ")";
      step.timeout = 30;
      step.on_failure.then = OnFailure::Then::go_on;
      step.gates = {{not_seen, 1}};
      add(step, config);
      step.verb = dwell;
      step.name = "dwell (" + which + ")";
      step.phase = phase;
      step.timeout = timeout;
      step.on_failure = around.on_failure;
      step.when_lost = around.when_lost.value_or(WhenLost::skip);
      step.gates = {{seen, 1}};
      add(step, config);
    }
  }

  const Source& source_;
  Library& library_;
  Unrolled& result_;
};

}  // namespace

Unrolled unroll(const Source& source, const std::string& list, Library& library) {
  Unrolled result;
  Unroller(source, library, result).list(Config(source.tree, source.file), list, {});
  return result;
}

const std::vector<VerbInfo>& blocks() {
  static const std::vector<VerbInfo> all = {
      {"repeat",
       "the same steps again",
       "",
       {{"times", Kind::count, true, "", "how often"},
        {"steps", Kind::steps, true, "", "what is repeated"}}},
      {"sweep",
       "the steps for each value of a name, which stands in them as ${name}; several names make "
       "a grid, the last one changing fastest",
       "",
       {{"NAME", Kind::values, true, "", "a list of values, or {from, to, step}"},
        {"steps", Kind::steps, true, "", "what is done for each value"}}},
      {"call",
       "the steps of another procedure, and its limits while they run",
       "",
       {{"procedure", Kind::text, true, "", "its file, seen from this one's folder"},
        {"with", Kind::assignments, false, "as in its file", "its parameters"}},
       nullptr,
       Kind::text},
      {"calibrate",
       "goes to each pose, and waits at rest for good estimates; only the waiting is in its phase. "
       "A pose at which the target is not seen is left out",
       "3 min for each motion and each wait",
       {{"poses", Kind::poses, true, "", "poses of the target in the sensor frame"},
        {"frozen", Kind::texts, false, "none",
         "for each pose the arm that stands still on the way there: none, replica or sensor"},
        {"estimates", Kind::count, false, "20", "good ones at each pose"},
        {"returns", Kind::count, false, "the estimator's own choice",
         "returns of each scan after the target was lost and found again"},
        {"settle", Kind::time, false, "1 s", "at rest before the first scan counts"},
        {"speed", Kind::speed, true, "", "of the motions"},
        {"turn", Kind::angular_speed, false, "10 deg/s", "of the motions"}}},
  };
  return all;
}

}  // namespace berth::procedures
