// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/run_record.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <tuple>

#include "common/core/config.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "logs/file/log_reader.h"
#include "logs/file/reused_message.h"

namespace berth::evaluation {
namespace {

template <class Sample>
auto order(const Sample& sample) {
  return std::make_tuple(sample.utime, sample.seq);
}

std::tuple<std::int64_t, std::string, std::int64_t> order(const event_t& event) {
  return {event.utime, event.node, event.seq};
}

/// Keeps the samples in order of time; drops one that is there already. Messages come nearly in
/// order, so the place is near the end.
template <class Sample>
void insert(std::vector<Sample>& samples, Sample sample) {
  auto place = samples.end();
  while (place != samples.begin() && order(sample) < order(*std::prev(place))) --place;
  if (place != samples.begin() && order(*std::prev(place)) == order(sample)) return;
  samples.insert(place, std::move(sample));
}

/// Logs written before VERDICT_BASIS have it as an event.
std::optional<verdict_basis_t> basis_of_old_log(const std::vector<event_t>& events) {
  const auto last = std::find_if(events.rbegin(), events.rend(), [](const event_t& event) {
    return event.code == judged_event_code;
  });
  long long estimate = 0;
  long long diagnostics = 0;
  long long truth = 0;
  if (last == events.rend() ||
      std::sscanf(last->text.c_str(),
                  "on estimates up to seq %lld, diagnostics up to seq %lld, truth up to utime %lld",
                  &estimate, &diagnostics, &truth) != 3) {
    return std::nullopt;
  }
  verdict_basis_t basis{};
  basis.estimate_seq = estimate;
  basis.diagnostics_seq = diagnostics;
  basis.truth_utime = truth;
  return basis;
}

/// Published while that procedure ran.
bool is_of(const run_info_t& info, const procedure_state_t& state) {
  return info.procedure == state.procedure && state.utime_start <= info.utime &&
         info.utime <= state.utime;
}

}  // namespace

bool Phase::contains(Utime utime) const {
  return std::any_of(stretches.begin(), stretches.end(), [utime](const Stretch& stretch) {
    return stretch.start <= utime && utime <= stretch.end;
  });
}

double Phase::duration_s() const {
  double sum = 0;
  for (const Stretch& stretch : stretches) sum += seconds(stretch.end - stretch.start);
  return sum;
}

EstimateSample sample_of(const pose_estimate_t& message) {
  EstimateSample sample;
  sample.utime = message.utime;
  sample.seq = message.seq;
  sample.status = message.status;
  sample.pose = pose_of(message);
  sample.covariance = covariance_of(message.covariance);
  sample.velocity = velocity_of(message);
  sample.measured = pose_of(message.measured_position_m, message.measured_q_wxyz);
  sample.scan_id = message.scan_id;
  sample.first_packet = message.first_packet;
  sample.last_packet = message.last_packet;
  sample.returns_used = message.returns_used;
  return sample;
}

void RunRecord::add(const pose_estimate_t& message) { insert(estimates_, sample_of(message)); }

std::optional<Utime> latency_in(const estimator_diagnostics_t& message) {
  for (std::size_t i = 0; i < message.names.size(); ++i) {
    if (message.names[i] == "latency_us") return static_cast<Utime>(message.values[i]);
  }
  return std::nullopt;
}

void RunRecord::add(const estimator_diagnostics_t& message) {
  if (const auto latency = latency_in(message)) {
    insert(latencies_, LatencySample{message.utime, message.seq, *latency});
  }
}

void RunRecord::add(const testbed_state_t& message) {
  if (message.state == testbed_state_t::NOT_READY) return;  // nothing has been commanded yet
  insert(commanded_,
         CommandedSample{message.utime, message.seq,
                         pose_of(message.commanded_position_m, message.commanded_q_wxyz),
                         message.state == testbed_state_t::CLOSED_LOOP});
}

void RunRecord::add(const testbed_command2_t& message) {
  if (message.command != testbed_command2_t::APPROACH || message.dock == 0) return;
  docking_ports_.emplace(message.utime, message.port);
}

std::string RunRecord::docking_port(Utime until) const {
  const auto after = docking_ports_.upper_bound(until);
  return after == docking_ports_.begin() ? "" : std::prev(after)->second;
}

void RunRecord::add(const ScanPacket& message) {
  constexpr std::size_t max_kept = 100;
  const auto [place, is_new] = returns_.try_emplace({message.scan_id, message.packet});
  if (!is_new) return;
  std::vector<std::size_t> hits;
  for (std::size_t i = 0; i < message.status.size(); ++i) {
    if (message.status[i] == ScanPacket::HIT) hits.push_back(i);
  }
  const std::size_t step = (hits.size() + max_kept - 1) / max_kept;
  for (std::size_t i = 0; i < hits.size(); i += step) {
    const std::size_t beam = hits[i];
    const ScanPacket::Seen seen = message.seen_from_sensor(beam);
    place->second.push_back({message.utime + message.time_us[beam], static_cast<float>(seen.range),
                             static_cast<float>(seen.azimuth), static_cast<float>(seen.elevation)});
  }
}

std::vector<ScanReturn> RunRecord::returns_of(const EstimateSample& estimate) const {
  std::vector<ScanReturn> returns;
  const auto end = returns_.upper_bound({estimate.scan_id, estimate.last_packet});
  for (auto packet = returns_.lower_bound({estimate.scan_id, estimate.first_packet}); packet != end;
       ++packet) {
    returns.insert(returns.end(), packet->second.begin(), packet->second.end());
  }
  return returns;
}

void RunRecord::add(const procedure_state_t& message) {
  const auto [known, is_new] = states_.try_emplace(message.utime_start, message);
  if (!is_new && order(known->second) < order(message)) known->second = message;
}

void RunRecord::add(const run_info_t& message) {
  const auto [known, is_new] = infos_.try_emplace(message.run, message);
  if (!is_new && order(message) < order(known->second)) known->second = message;
}

void RunRecord::add(const event_t& message) { insert(events_, message); }

void RunRecord::add(const setpoint_latency_t& message) { insert(setpoint_latencies_, message); }

void RunRecord::add(const injection_t& message) {
  if (message.action == injection_t::INJECT) injected_.insert(message.seq);
}

void RunRecord::add(const injection_state_t& message) {
  const auto [known, is_new] =
      injections_carried_out_.try_emplace(message.accepted_seq, message.utime);
  if (!is_new) known->second = std::min(known->second, message.utime);
}

std::vector<Utime> RunRecord::fault_times() const {
  std::vector<Utime> times;
  for (const auto& [seq, utime] : injections_carried_out_) {
    if (injected_.count(seq) > 0) times.push_back(utime);
  }
  return times;
}

void RunRecord::add(const verdict_basis_t& message) { insert(bases_, message); }

void RunRecord::add(const ground_truth_t& message) {
  truth_.add(sample_of(message));
  const auto [basis, is_new] = truth_bases_.try_emplace(
      {message.basis, message.calibration_hash}, Phase::Stretch{message.utime, message.utime});
  basis->second.start = std::min(basis->second.start, message.utime);
  basis->second.end = std::max(basis->second.end, message.utime);
}

std::vector<TruthBasis> RunRecord::truth_bases() const {
  std::vector<TruthBasis> bases;
  for (const auto& [basis, time] : truth_bases_) bases.push_back(basis);
  return bases;
}

const procedure_state_t* RunRecord::state() const {
  return states_.empty() ? nullptr : &states_.rbegin()->second;
}

const run_info_t* RunRecord::info() const {
  if (infos_.empty()) return nullptr;
  if (infos_.size() == 1 && states_.size() <= 1) return &infos_.begin()->second;
  const procedure_state_t* state = this->state();
  const run_info_t* first = nullptr;
  for (const auto& [name, info] : infos_) {
    if ((state == nullptr || is_of(info, *state)) &&
        (first == nullptr || info.utime < first->utime)) {
      first = &info;
    }
  }
  return first;
}

RunRecord RunRecord::run(const procedure_state_t& state) const {
  const auto within = [&state](const auto& sample) {
    return state.utime_start <= sample.utime && sample.utime <= state.utime;
  };
  RunRecord run;
  run.states_ = {{state.utime_start, state}};
  std::copy_if(infos_.begin(), infos_.end(), std::inserter(run.infos_, run.infos_.end()),
               [&state](const auto& info) { return is_of(info.second, state); });
  std::copy_if(estimates_.begin(), estimates_.end(), std::back_inserter(run.estimates_), within);
  std::copy_if(latencies_.begin(), latencies_.end(), std::back_inserter(run.latencies_), within);
  std::copy_if(commanded_.begin(), commanded_.end(), std::back_inserter(run.commanded_), within);
  std::copy_if(events_.begin(), events_.end(), std::back_inserter(run.events_), within);
  std::copy_if(setpoint_latencies_.begin(), setpoint_latencies_.end(),
               std::back_inserter(run.setpoint_latencies_), within);
  std::copy_if(bases_.begin(), bases_.end(), std::back_inserter(run.bases_), within);
  run.injected_ = injected_;
  run.injections_carried_out_ = injections_carried_out_;
  for (const TruthSample& sample : truth_.between(state.utime_start, state.utime)) {
    run.truth_.add(sample);
  }
  for (const auto& [basis, time] : truth_bases_) {
    if (time.start <= state.utime && state.utime_start <= time.end) {
      run.truth_bases_[basis] = time;
    }
  }
  return run;
}

std::vector<RunRecord> RunRecord::runs() && {
  std::vector<RunRecord> runs;
  if (states_.size() <= 1) {
    runs.push_back(std::move(*this));
    return runs;
  }
  for (const auto& [start, state] : states_) runs.push_back(run(state));
  return runs;
}

verdict_basis_t RunRecord::basis() const {
  // An estimator that was started anew counts from one again.
  verdict_basis_t basis{};
  for (const auto& e : estimates_) basis.estimate_seq = std::max(basis.estimate_seq, e.seq);
  for (const auto& l : latencies_) basis.diagnostics_seq = std::max(basis.diagnostics_seq, l.seq);
  if (!truth_.samples().empty()) basis.truth_utime = truth_.samples().back().utime;
  return basis;
}

void RunRecord::keep_judged() {
  const auto basis = bases_.empty() ? basis_of_old_log(events_) : bases_.back();
  if (!basis) return;
  std::erase_if(estimates_, [&](const auto& e) { return e.seq > basis->estimate_seq; });
  std::erase_if(latencies_, [&](const auto& l) { return l.seq > basis->diagnostics_seq; });
  truth_.forget_after(basis->truth_utime);
}

bool RunRecord::steered(Utime utime) const {
  // A state holds until the next one.
  const auto after =
      std::upper_bound(commanded_.begin(), commanded_.end(), utime,
                       [](Utime t, const CommandedSample& sample) { return t < sample.utime; });
  return after != commanded_.begin() && std::prev(after)->by_estimate;
}

std::vector<Phase> RunRecord::phases() const {
  std::vector<Phase> phases;
  Phase whole{whole_run, {}};
  const procedure_state_t* state = this->state();
  if (state == nullptr) return phases;
  for (const procedure_step_t& step : state->steps) {
    if (step.utime_start == 0) continue;
    // A log that was cut off leaves its last step open: it lasted at least to the last state.
    const Utime end = step.utime_end != 0 ? step.utime_end : state->utime;
    auto phase = std::find_if(phases.begin(), phases.end(),
                              [&](const Phase& p) { return p.name == step.phase; });
    if (phase == phases.end()) phase = phases.insert(phases.end(), Phase{step.phase, {}});
    phase->stretches.push_back({step.utime_start, end});
    if (step.phase == teardown_phase) continue;
    if (whole.stretches.empty()) whole.stretches.push_back({step.utime_start, end});
    whole.stretches.back().end = end;
  }
  if (!whole.stretches.empty()) phases.push_back(whole);
  return phases;
}

std::optional<Phase> RunRecord::phase(const std::string& name) const {
  for (Phase& phase : phases()) {
    if (phase.name == name) return std::move(phase);
  }
  return std::nullopt;
}

const char* text_of_host(std::int8_t host) {
  constexpr const char* names[] = {"cell", "simulated cell", "twin"};
  return host >= 0 && host <= run_info_t::TWIN ? names[host] : "unknown";
}

std::string world_of(const run_info_t& info) {
  std::string world;
  if (info.host == run_info_t::CELL) return world;
  for (const attachment_t& file : info.attachments) {
    if (file.name != "simulation.yaml" || file.content.empty()) continue;
    try {
      Config::parse(file.content, file.name).optional("world", world);
    } catch (const InputError&) {  // a damaged log
    }
  }
  return world;
}

std::string place_of(const run_info_t& info) {
  const std::string world = world_of(info);
  return text_of_host(info.host) + (world.empty() ? "" : " in " + world);
}

namespace {

/// Decodes messages for the records of their sessions and keeps the counts.
class Filler {
 public:
  Filler(LogSummary& summary, std::optional<std::int64_t> session)
      : summary_(summary), session_(session) {}

  void take(const logs::LogEvent& event) {
    if (event.channel == channels::ground_truth) {
      add<ground_truth_t>(event);
    } else if (event.channel == channels::pose_estimate) {
      add<pose_estimate_t>(event);
    } else if (event.channel == channels::estimator_diagnostics) {
      add<estimator_diagnostics_t>(event);
    } else if (event.channel == channels::procedure_state) {
      add<procedure_state_t>(event);
    } else if (event.channel == channels::run_info) {
      add<run_info_t>(event);
    } else if (event.channel == channels::event) {
      add<event_t>(event);
    } else if (event.channel == channels::testbed_state) {
      add<testbed_state_t>(event);
    } else if (event.channel == channels::testbed_command) {
      // testbed_command_t of older logs names no port
      if (std::get<logs::ReusedMessage<testbed_command2_t>>(messages_).decode(event.data) ==
          nullptr)
        return;
      add<testbed_command2_t>(event);
    } else if (event.channel == channels::setpoint_latency) {
      add<setpoint_latency_t>(event);
    } else if (event.channel == channels::injection) {
      add<injection_t>(event);
    } else if (event.channel == channels::injection_state) {
      add<injection_state_t>(event);
    } else if (event.channel == channels::verdict_basis) {
      add<verdict_basis_t>(event);
    } else if (event.channel == channels::scan_data) {
      add<ScanPacket>(event);
    }
  }

  /// Those of sessions with a procedure, by their starts.
  std::vector<RunRecord> runs() {
    std::vector<RunRecord> runs;
    for (auto& [session, of] : sessions_) {
      if (!of.record.info() && !of.record.state()) {
        summary_.other_session += of.messages;
        continue;
      }
      for (RunRecord& run : std::move(of.record).runs()) {
        run.keep_judged();
        runs.push_back(std::move(run));
      }
    }
    std::stable_sort(runs.begin(), runs.end(), [](const RunRecord& a, const RunRecord& b) {
      return start_of(a) < start_of(b);
    });
    return runs;
  }

 private:
  struct Session {
    RunRecord record;
    std::int64_t messages = 0;
  };

  static Utime start_of(const RunRecord& run) {
    return run.state() ? run.state()->utime_start : run.info()->utime;
  }

  template <class Message>
  void add(const logs::LogEvent& event) {
    const Message* message = std::get<logs::ReusedMessage<Message>>(messages_).decode(event.data);
    if (message == nullptr) {
      ++summary_.undecodable;
    } else if (session_ && message->session != *session_) {
      ++summary_.other_session;
    } else {
      Session& session = sessions_[message->session];
      session.record.add(*message);
      ++session.messages;
    }
  }

  LogSummary& summary_;
  std::optional<std::int64_t> session_;
  std::map<std::int64_t, Session> sessions_;
  std::tuple<logs::ReusedMessage<ground_truth_t>, logs::ReusedMessage<pose_estimate_t>,
             logs::ReusedMessage<estimator_diagnostics_t>, logs::ReusedMessage<procedure_state_t>,
             logs::ReusedMessage<run_info_t>, logs::ReusedMessage<event_t>,
             logs::ReusedMessage<testbed_state_t>, logs::ReusedMessage<testbed_command2_t>,
             logs::ReusedMessage<setpoint_latency_t>, logs::ReusedMessage<verdict_basis_t>,
             logs::ReusedMessage<injection_t>, logs::ReusedMessage<injection_state_t>,
             logs::ReusedMessage<ScanPacket>>
      messages_;
};

}  // namespace

std::vector<RunRecord> read_runs(const std::filesystem::path& log, LogSummary& summary,
                                 std::optional<std::int64_t> session, const LogVisitor& visitor) {
  logs::LogReader reader(log);
  summary = {};
  Filler filler(summary, session);
  logs::LogEvent event;
  while (reader.next(event)) {
    if (summary.first == 0) summary.first = event.utime;
    summary.last = event.utime;
    filler.take(event);
    if (visitor) visitor(event);
  }
  summary.events = reader.events();
  summary.missing_events = reader.missing_events();
  summary.damaged_bytes = reader.damaged_bytes();
  return filler.runs();
}

RunRecord read_run(const std::filesystem::path& log, LogSummary& summary,
                   std::optional<std::int64_t> session, const LogVisitor& visitor) {
  std::vector<RunRecord> runs = read_runs(log, summary, session, visitor);
  return runs.empty() ? RunRecord() : std::move(runs.back());
}

}  // namespace berth::evaluation
