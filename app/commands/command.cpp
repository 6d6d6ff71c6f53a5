// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <berth/operator_control_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/active_runs.h"
#include "app/runs/run_files.h"
#include "app/terminal/procedure_client.h"
#include "common/bus/lcm_bus.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "lcmtypes/channels.h"
#include "procedures/engine/operator_control.h"

namespace berth::commands {
namespace {

using State = procedure_state_t;

struct Verb {
  std::int8_t command;
  std::vector<std::string> arguments;
  /// Whether the engine has obeyed, by its state before and now.
  bool (*obeyed)(const State& before, const State& now, const procedure_command_t& command);
};

const procedure_step_t* step_of(const State& state, std::int32_t index) {
  const bool known = index >= 0 && index < static_cast<std::int32_t>(state.steps.size());
  return known ? &state.steps[static_cast<std::size_t>(index)] : nullptr;
}

bool went_on(const State& before, const State& now, const procedure_command_t&) {
  return (before.state == State::HELD && now.state != State::HELD) ||
         now.current_step != before.current_step;
}

bool skipped(const State& before, const State& now, const procedure_command_t&) {
  const procedure_step_t* step = step_of(now, before.current_step);
  return step != nullptr && step->state == procedure_step_t::SKIPPED;
}

bool tried_again(const State& before, const State& now, const procedure_command_t&) {
  const procedure_step_t* was = step_of(before, before.current_step);
  const procedure_step_t* is = step_of(now, before.current_step);
  return was != nullptr && is != nullptr && is->attempts > was->attempts;
}

bool testbed_ready(const State&, const State& now, const procedure_command_t&) {
  return std::any_of(now.preconditions.begin(), now.preconditions.end(),
                     [](const auto& p) { return p.name == "testbed" && p.met; });
}

/// Of what the procedure's state does not show: it is accepted.
bool at_once(const State&, const State&, const procedure_command_t&) { return true; }

bool answered(const State&, const State& now, const procedure_command_t& command) {
  return now.state != State::PROMPTING || now.prompt_id != command.prompt_id;
}

const std::map<std::string, Verb>& verbs() {
  static const std::map<std::string, Verb> table{
      {"hold",
       {procedure_command_t::HOLD,
        {},
        [](const State&, const State& now, const procedure_command_t&) {
          return now.state == State::HELD;
        }}},
      {"resume", {procedure_command_t::RESUME, {}, went_on}},
      {"step", {procedure_command_t::STEP, {}, at_once}},
      {"skip", {procedure_command_t::SKIP, {}, skipped}},
      {"retry", {procedure_command_t::RETRY, {}, tried_again}},
      {"reset", {procedure_command_t::RESET, {}, testbed_ready}},
      {"abort",
       {procedure_command_t::ABORT,
        {},
        [](const State&, const State& now, const procedure_command_t&) {
          return now.state == State::TEARDOWN || now.state == State::FINISHED;
        }}},
      {"answer", {procedure_command_t::ANSWER, {"ID", "TEXT"}, answered}},
      {"speed", {procedure_command_t::SPEED, {"PERCENT"}, at_once}},
      {"lamps", {procedure_command_t::LAMPS, {"LAMPS"}, at_once}},
      {"take", {procedure_command_t::TAKE_CONTROL, {}, at_once}},
      {"release", {procedure_command_t::RELEASE_CONTROL, {}, at_once}},
  };
  return table;
}

struct CommandOptions {
  std::vector<std::string> words;
  std::string reason;
  std::string name;
  bool over = false;
  bool hold_when_lost = false;
  double timeout = 10;
};

/// The text of a TAKE_CONTROL.
std::string control_words(const CommandOptions& options) {
  std::string words = options.over ? procedures::take_over_word : "";
  if (!options.hold_when_lost) return words;
  return words + (words.empty() ? "" : ", ") + procedures::hold_when_lost_word;
}

/// Sends the command once the run's state is known, and watches whether it is obeyed. Control, once
/// taken, is kept until it is given back, taken over, or the procedure or this process ends.
class CommandRequest {
 public:
  CommandRequest(const ActiveRun& run, const Verb& verb, procedure_command_t command,
                 const CommandOptions& options)
      : files_(RunFiles::open(run.directory)),
        loop_(clock_offset_now()),
        bus_(run.url, loop_),
        client_(bus_, loop_, files_.setup.session,
                options.name.empty() ? ProcedureClient::operator_name() : options.name),
        verb_(verb),
        command_(std::move(command)) {
    bus_.subscribe<State>(channels::procedure_state, Queue::fifo(),
                          [this](const State& state) { take(state); });
    bus_.subscribe<operator_control_t>(
        channels::operator_control, Queue::fifo(),
        [this](const operator_control_t& control) { take(control); });
    loop_.on_signals([this](int) { give_back(); });
    loop_.after(utime_from_seconds(options.timeout), [this] {
      if (keeps_control_) return;
      end(!now_       ? "no state of the procedure was received"
          : accepted_ ? "it was not obeyed in time"
                      : "no answer");
    });
  }

  /// Empty when it was obeyed, else why not.
  std::string run() {
    bus_.start();
    loop_.run();
    return failure_;
  }

 private:
  void take(const State& state) {
    if (state.session != files_.setup.session) return;
    if (state.state == State::FINISHED && keeps_control_) return loop_.stop();
    if (state.state == State::FINISHED && !now_) return end("the procedure has finished");
    now_ = state;
    if (before_) return look();
    before_ = state;
    const procedure_step_t* step = step_of(state, state.current_step);
    if (command_.command == procedure_command_t::ANSWER && step != nullptr &&
        command_.prompt_id == step->name) {
      command_.prompt_id = state.prompt_id;  // named by its step
    }
    client_.send(command_, [this](CommandStatus status, const std::string& reason) {
      if (status != CommandStatus::accepted) return end(reason);
      accepted_ = true;
      look();
    });
  }

  void take(const operator_control_t& control) {
    if (control.session != files_.setup.session) return;
    const bool ours = control.holder == client_.name();
    if (keeps_control_ && !ours) {
      std::printf("%s\n", control.holder.empty()
                              ? "control was given back"
                              : (control.holder + " has taken control over").c_str());
      loop_.stop();
    } else if (ours && !keeps_control_ && command_.command == procedure_command_t::TAKE_CONTROL) {
      keeps_control_ = true;
      std::printf("%s has control; Ctrl-C gives it back\n", client_.name().c_str());
      std::fflush(stdout);
      loop_.every(500 * millisecond, [this] { client_.keep_control(); });
    }
  }

  void give_back() {
    if (!keeps_control_) return end("interrupted");
    procedure_command_t release{};
    release.command = procedure_command_t::RELEASE_CONTROL;
    client_.send(release);  // the answer is that control is no longer ours
    loop_.after(second, [this] { loop_.stop(); });
  }

  void look() {
    const bool lasts = command_.command == procedure_command_t::TAKE_CONTROL;
    if (accepted_ && !lasts && verb_.obeyed(*before_, *now_, command_)) loop_.stop();
  }

  void end(const std::string& failure) {
    failure_ = failure;
    loop_.stop();
  }

  RunFiles files_;
  ProcessLoop loop_;
  LcmBus bus_;
  ProcedureClient client_;
  const Verb& verb_;
  procedure_command_t command_;
  std::optional<State> before_;
  std::optional<State> now_;
  bool accepted_ = false;
  bool keeps_control_ = false;
  std::string failure_;
};

int command(const CommandOptions& options) {
  std::vector<std::string> words = options.words;
  std::filesystem::path directory;
  if (verbs().count(words.front()) == 0) {
    directory = words.front();
    words.erase(words.begin());
  }
  const auto verb = words.empty() ? verbs().end() : verbs().find(words.front());
  if (verb == verbs().end()) {
    std::string known;
    for (const auto& [name, unused] : verbs()) known += (known.empty() ? "" : ", ") + name;
    throw InputError("command: found '" + (words.empty() ? directory.string() : words.front()) +
                     "', expected one of: " + known);
  }
  const auto& arguments = verb->second.arguments;
  if (words.size() != 1 + arguments.size()) {
    std::string expected;
    for (const auto& name : arguments) expected += (expected.empty() ? "" : " and ") + name;
    throw InputError("command " + verb->first + ": expected " +
                     (expected.empty() ? "nothing" : expected) + " behind it");
  }
  procedure_command_t request{};
  request.command = verb->second.command;
  request.text = options.reason;
  if (request.command == procedure_command_t::SKIP && options.reason.empty()) {
    throw InputError("command skip: expected --reason");
  }
  if (request.command == procedure_command_t::ANSWER) {
    request.prompt_id = words[1];
    request.text = words[2];
  }
  if (request.command == procedure_command_t::SPEED) {
    request.text = words[1];
    procedures::speed_override_of(request.text);  // wrong words need not travel
  }
  if (request.command == procedure_command_t::LAMPS) request.text = words[1];
  if (request.command == procedure_command_t::TAKE_CONTROL) request.text = control_words(options);
  const std::string failure =
      CommandRequest(require_active_run(directory), verb->second, request, options).run();
  if (failure.empty()) return exit_code::passed;
  print_text("berth: " + verb->first + ": " + failure + "\n", stderr);
  return exit_code::error;
}

}  // namespace

void add_command(CLI::App& app, int& exit_code) {
  auto* sub = app.add_subcommand(
      "command",
      "Ask something of a running procedure: [RUN] hold | resume | step | skip | retry |\n"
      "reset | abort | answer ID TEXT | speed '60 %' | lamps 'sun: 80 %, albedo: 10 %' | take | "
      "release.\n"
      "take keeps control, so that no other operator steers, until Ctrl-C, release, or the end.\n"
      "Exit code 0 when it was obeyed, 2 when not.");
  auto options = std::make_shared<CommandOptions>();
  sub->add_option("words", options->words,
                  "Run directory (the newest run when left out), and the request")
      ->required()
      ->type_name("[RUN] VERB");
  sub->add_option("--reason", options->reason, "Why: needed for skip; kept in the log");
  sub->add_option(
      "--as", options->name,
      "Name of the operator; commands under one name are one operator's. Default: the user and "
      "the process");
  sub->add_flag("--over", options->over, "take: from the present holder of control");
  sub->add_flag("--hold-when-lost", options->hold_when_lost,
                "take: the procedure is held when control is no longer kept");
  sub->add_option("--timeout", options->timeout, "Seconds in which it must be obeyed")
      ->capture_default_str();
  sub->callback([options, &exit_code] { exit_code = command(*options); });
}

}  // namespace berth::commands
