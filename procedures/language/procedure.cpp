// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/procedure.h"

#include <algorithm>
#include <sstream>

#include "common/core/config.h"
#include "common/core/file.h"
#include "common/core/yaml.h"
#include "common/core/yaml_text.h"
#include "procedures/language/blocks.h"

namespace berth::procedures {
namespace {

InputError error_at(const std::string& file, int line, const std::string& what) {
  return InputError(file + ":" + std::to_string(line) + ": " + what);
}

bool needs_tracking(const Step& step) {
  const auto* hold = std::get_if<Hold>(&step.verb);
  return std::holds_alternative<Approach>(step.verb) || std::holds_alternative<Track>(step.verb) ||
         std::holds_alternative<Dwell>(step.verb) || (hold != nullptr && hold->closed_loop);
}

/// Steps that may wait for ever, which a teardown must not have.
bool may_never_end(const Step& step) {
  return needs_tracking(step) || std::holds_alternative<Acquire>(step.verb) ||
         std::holds_alternative<Guided>(step.verb) || std::holds_alternative<Prompt>(step.verb) ||
         std::holds_alternative<Inject>(step.verb);
}

void check_order(const Procedure& procedure) {
  bool tracking = false;
  for (const Step& step : procedure.steps) {
    if (std::holds_alternative<Acquire>(step.verb)) tracking = true;
    if (std::holds_alternative<StopTracking>(step.verb)) tracking = false;
    if (needs_tracking(step) && !tracking) {
      throw error_at(step.file, step.line, "step '" + step.name + "' needs an 'acquire' before it");
    }
  }
  for (const Step& step : procedure.teardown) {
    if (may_never_end(step)) {
      throw error_at(step.file, step.line,
                     "step '" + step.name + "' cannot be in the teardown, which must always work");
    }
  }
}

void check_phases(const Procedure& procedure) {
  std::string known = evaluation::whole_run;
  std::vector<std::string> phases;
  for (const Step& step : procedure.steps) {
    if (std::find(phases.begin(), phases.end(), step.phase) != phases.end()) continue;
    phases.push_back(step.phase);
    known += ", " + step.phase;
  }
  const auto is_known = [&phases](const std::string& phase) {
    return std::find(phases.begin(), phases.end(), phase) != phases.end();
  };
  for (const evaluation::Criterion& criterion : procedure.criteria) {
    if (criterion.phase == evaluation::whole_run || is_known(criterion.phase)) continue;
    throw error_at(procedure.file, criterion.line,
                   "key 'criteria': criterion '" + criterion.name + "': found phase '" +
                       criterion.phase + "', expected one of: " + known);
  }
  for (const evaluation::Figure& figure : procedure.figures) {
    for (const evaluation::FigureChart& chart : figure.charts) {
      for (const std::string& phase : chart.phases) {
        if (phase == evaluation::whole_run || is_known(phase)) continue;
        throw error_at(procedure.file, chart.line,
                       "key 'figures': figure '" + figure.name + "': found phase '" + phase +
                           "', expected one of: " + known);
      }
    }
  }
  for (const Limit& limit : procedure.limits) {
    if (limit.phase.empty() || is_known(limit.phase)) continue;
    throw error_at(limit.file, limit.line,
                   "key 'limits': limit '" + limit.name + "': found phase '" + limit.phase +
                       "', expected one of: " + known);
  }
}

/// PROCEDURE_STATE lists all steps in one message, with a detail for each.
void check_size(const Procedure& procedure, const Config& config) {
  constexpr std::size_t max_bytes = 52000;
  constexpr std::size_t bytes_per_step = 77;
  std::size_t bytes = 0;
  std::size_t count = 0;
  for (const auto* list : {&procedure.steps, &procedure.teardown}) {
    for (const Step& step : *list) {
      bytes += bytes_per_step + step.name.size() + step.phase.size();
      ++count;
    }
  }
  if (count <= max_steps && bytes <= max_bytes) return;
  throw config.error("steps", "found " + std::to_string(count) +
                                  " steps in all, expected at most " + std::to_string(max_steps) +
                                  ", with short names");
}

std::vector<Step> default_teardown(const std::string& file) {
  Step stop{StopTracking{}, "stop_tracking", "", 20};
  Step dark{Lights{}, "lights off", "", 20};
  stop.file = dark.file = file;
  return {stop, dark};
}

bool injects(const Step& step) { return std::holds_alternative<Inject>(step.verb); }

/// The teardown always begins with the end of injected faults.
void clear_injections_first(Procedure& procedure) {
  if (std::none_of(procedure.steps.begin(), procedure.steps.end(), injects)) return;
  const auto clears_all = [](const Step& step) {
    const auto* clear = std::get_if<ClearInjections>(&step.verb);
    return clear != nullptr && clear->device.empty();
  };
  auto& teardown = procedure.teardown;
  if (std::any_of(teardown.begin(), teardown.end(), clears_all)) return;
  Step clear{ClearInjections{}, "clear_injections", "", 15};
  clear.file = procedure.file;
  teardown.insert(teardown.begin(), clear);
}

void take_attached(Config& config, Library& library) {
  if (!config.has("called")) return;
  Config called = config.section("called");
  for (const std::string& name : called.keys()) library.attach(name, called.text(name));
}

/// The text with all that it refers to attached.
std::string text_as_run(const Source& source, const Library& library) {
  if (source.as_run) return source.text;
  std::string text =
      source.text + "\n# Added when it was run, so that this text stands alone.\nas_run: true\n";
  YamlNode tree = read_yaml(source.text, source.file);
  tree.put("as_run", "true");
  YamlNode called(YamlNode::Kind::map);
  if (!library.texts().empty()) text += "called:\n";
  for (const auto& [name, content] : library.texts()) {
    called.put(name, content);
    text += "  " + quoted(name) + ": ";
    // A block ends with one line end.
    if (content.size() < 2 || content.back() != '\n' || content[content.size() - 2] == '\n') {
      text += quoted(content) + "\n";
      continue;
    }
    text += "|2\n";
    std::istringstream in(content);
    for (std::string line; std::getline(in, line);) text += "    " + line + "\n";
  }
  if (called.size() > 0) tree.put("called", called);
  // In either style the kept text reads as the procedure that runs.
  return edited(text, {}, tree).value_or(written(tree));
}

}  // namespace

const std::vector<KeyInfo>& procedure_keys() {
  static const std::vector<KeyInfo> keys = {
      {"name", Kind::text, true, "", "of the procedure"},
      {"description", Kind::text, false, "", "for a person"},
      {"layout", Kind::text, false, "the operator's choice", "of config/layouts"},
      {"target", Kind::text, false, "the operator's choice",
       "a name of targets/, a folder with a target.yaml, or a mesh"},
      {"target_length", Kind::length, false, "as it is", "longest side of the target"},
      {"world", Kind::text, false, "the operator's choice",
       "of config/worlds, of the simulated cell"},
      {"parameters", Kind::assignments, false, "none", "names and values, ${name} in the text"},
      {"lost_for", Kind::time, false, "15 s",
       "without a good estimate, while tracking, after which the run has failed"},
      {"limits", Kind::limits, false, "none", "live quantities watched in the background"},
      {"steps", Kind::steps, true, "", "what is done, in this order"},
      {"teardown", Kind::steps, false, "stop_tracking, lights off", "always done"},
      {"criteria", Kind::criteria, false, "none", "measurements that decide pass or fail"},
      {"source", Kind::text, false, "none", "of its claims and figures: a publication"},
      {"figures", Kind::figures, false, "none", "of the source, drawn again by the report"},
      {"as_run", Kind::boolean, false, "false", "written when it is run"},
      {"called", Kind::assignments, false, "none", "written when it is run: called procedures"},
  };
  return keys;
}

void check_top_level(Config& config) {
  for (const KeyInfo& info : procedure_keys()) {
    if (!info.required) {
      config.raw(info.key);
    } else if (!config.has(info.key)) {
      throw config.error(info.key, "is missing");
    }
    config.raw(info.key);
  }
  config.finish();
}

Procedure parse_procedure(const std::string& text, const std::string& file,
                          const Overrides& overrides) {
  const std::filesystem::path path = file;
  const Source source = make_source(text, file, path.filename().string(), overrides);
  Config config(source.tree, file);
  check_top_level(config);
  Library library(path.parent_path());
  take_attached(config, library);
  Procedure procedure;
  procedure.file = file;
  procedure.name = config.text("name");
  config.optional("description", procedure.description);
  config.optional("layout", procedure.layout);
  config.optional("target", procedure.target);
  config.optional("world", procedure.world);
  if (config.has("layout")) procedure.layout_line = config.raw("layout").line();
  if (config.has("target")) procedure.target_line = config.raw("target").line();
  if (config.has("world")) procedure.world_line = config.raw("world").line();
  config.optional("target_length", Dimension::length, procedure.target_length);
  config.optional("lost_for", Dimension::time, procedure.lost_for, above(0));
  Unrolled steps = unroll(source, "steps", library);
  procedure.steps = std::move(steps.steps);
  procedure.limits = read_limits(config);
  for (Limit& limit : procedure.limits) {
    limit.last_step = static_cast<int>(procedure.steps.size()) - 1;
  }
  for (Limit& limit : steps.limits) procedure.limits.push_back(std::move(limit));
  procedure.teardown =
      config.has("teardown") ? unroll(source, "teardown", library).steps : default_teardown(file);
  clear_injections_first(procedure);
  for (Step& step : procedure.teardown) step.phase = evaluation::teardown_phase;
  check_size(procedure, config);
  procedure.criteria = evaluation::read_criteria(config);
  config.optional("source", procedure.source);
  procedure.figures = evaluation::read_figures(config, procedure.criteria);
  check_order(procedure);
  check_phases(procedure);
  procedure.text = text_as_run(source, library);
  return procedure;
}

Procedure load_procedure(const std::filesystem::path& file, const Overrides& overrides) {
  return parse_procedure(read_file(file), file.string(), overrides);
}

std::vector<std::filesystem::path> procedures_in(const std::filesystem::path& directory) {
  const auto other = [](const std::filesystem::path& file) {
    try {
      return !read_written(read_file(file), file.string()).tree.has("steps");
    } catch (const InputError&) {
      return false;
    }
  };
  std::vector<std::filesystem::path> files = yaml_files(directory);
  files.erase(std::remove_if(files.begin(), files.end(), other), files.end());
  return files;
}

}  // namespace berth::procedures
