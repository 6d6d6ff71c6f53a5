// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/replay/replay_source.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/console/replay/recorded_run.h"
#include "app/console/view/section.h"
#include "app/runs/replay/player.h"
#include "common/core/error.h"
#include "common/core/text.h"

namespace berth::console {
namespace {

/// The sections of a second run, under names of its own.
class ReferenceSink : public Sink {
 public:
  explicit ReferenceSink(Sink& sink) : sink_(sink) {}
  void at(Utime /*utime*/) override {}
  void set(const std::string& section, std::string json) override {
    if (shown(section)) sink_.set(section + "2", std::move(json));
  }
  void add(const std::string& list, std::string json) override {
    if (shown(list)) sink_.add(list + "2", std::move(json));
  }
  void reset(const std::string& list) override {
    if (shown(list)) sink_.reset(list + "2");
  }

 private:
  static bool shown(const std::string& name) {
    constexpr std::array names = {"run", "estimate", "truth", "samples", "procedure"};
    return std::find(names.begin(), names.end(), name) != names.end();
  }

  Sink& sink_;
};

/// A recorded run with its view, standing at a place in its log.
class ReplayCursor {
 public:
  ReplayCursor(const RecordedRun& run, const logs::TypeCatalogue& types, Sink& sink,
               const CellView::Options& options)
      : run_(run), view_(run.cell(), run.lidar(), types, sink, options) {}

  CellView& view() { return view_; }

  void take(const logs::LogEvent& event) { view_.take(event); }
  void jump(std::size_t place) { run_.build(view_, place); }

  /// Goes to a time in the log, forwards or back.
  void follow(Utime log_time) {
    const std::size_t place = run_.index().not_before(log_time + 1);
    const bool far = place < place_ || log_time - last_ > RecordedRun::run_up;
    if (far) jump(place);
    for (; !far && place_ < place; ++place_) take(run_.index().at(place_));
    place_ = place;
    last_ = log_time;
  }

 private:
  const RecordedRun& run_;
  CellView view_;
  std::size_t place_ = 0;
  Utime last_ = 0;
};

CellView::Options options_of(const RecordedRun& run, Utime start) {
  CellView::Options options;
  options.with_samples = false;
  options.start = start;
  options.verdicts = run.verdicts();
  options.more_of_run = {{"length_s", rounded(run.length_s(), 1e-3)},
                         {"directory", run.files().directory.filename().string()},
                         {"marks", run.marks()}};
  return options;
}

double number(const nlohmann::json& arguments, const char* key) {
  const auto found = arguments.find(key);
  if (found == arguments.end() || !found->is_number() || !std::isfinite(found->get<double>())) {
    throw InputError(std::string(key) + ": expected a number");
  }
  return found->get<double>();
}

/// Empty: by event.
std::string channel_in(const nlohmann::json& arguments) {
  const auto found = arguments.find("channel");
  if (found == arguments.end()) return {};
  if (!found->is_string()) throw InputError("channel: expected a channel's name");
  return found->get<std::string>();
}

}  // namespace

class ReplaySource::Impl {
 public:
  Impl(const std::filesystem::path& run, const std::filesystem::path& second,
       const logs::TypeCatalogue& types, Sink& sink, Utime wall, const Progress& progress)
      : sink_(sink),
        reference_sink_(sink),
        first_run_(run,
                   [&](double part) {
                     if (progress) progress(second.empty() ? part : part / 2);
                   }),
        first_(first_run_, types, sink, options_of(first_run_, first_run_.index().first())),
        player_(
            first_run_.index(), {}, [this](const logs::LogEvent& event) { first_.take(event); },
            [this](std::size_t place) { jump(place); }) {
    publish_samples(first_run_, first_run_.index().first(), sink);
    if (!second.empty()) {
      second_run_ = std::make_unique<RecordedRun>(second, [&](double part) {
        if (progress) progress((1 + part) / 2);
      });
      ahead_ = second_run_->begin() - first_run_.begin();
      const Utime start = first_run_.index().first() + ahead_;
      second_ = std::make_unique<ReplayCursor>(*second_run_, types, reference_sink_,
                                               options_of(*second_run_, start));
      publish_samples(*second_run_, start, reference_sink_);
    }
    first_.jump(0);
    player_.start(wall);
    run_to(wall);
  }

  std::map<std::string, std::string> meshes() const {
    return mesh_texts(drawn_bodies(first_run_.cell()));
  }

  void run(Utime wall) {
    // What would take longer to show than to build up is passed over.
    if (player_.position(wall) - position_ > RecordedRun::run_up) player_.seek(0, wall);
    run_to(wall);
  }

  std::string obey(const std::string& command, const nlohmann::json& arguments, Utime wall) {
    std::string done;
    if (command == "play") {
      if (player_.finished()) player_.seek(-player_.position(wall), wall);
      if (player_.paused()) player_.pause_or_go(wall);
      done = "plays";
    } else if (command == "pause") {
      if (!player_.paused()) player_.pause_or_go(wall);
      done = "paused at " + place(wall);
    } else if (command == "seek") {
      const double to = std::clamp(number(arguments, "position_s"), 0.0, first_run_.length_s());
      player_.seek(utime_from_seconds(to) - player_.position(wall), wall);
      done = "at " + place(wall);
    } else if (command == "rate") {
      const double factor = number(arguments, "factor");
      if (!(factor > 0)) throw InputError("factor: expected a number above 0");
      player_.change_rate(factor / player_.rate(), wall);
      done = fixed(player_.rate(), 2) + " times real time";
    } else if (command == "step") {
      step(channel_in(arguments), wall);
      done = "at " + place(wall);
    } else if (command == "loop") {
      const auto on = arguments.find("on");
      if (on == arguments.end() || !on->is_boolean())
        throw InputError("on: expected true or false");
      if (on->get<bool>() != player_.loops()) player_.loop_or_not();
      done = player_.loops() ? "begins anew at its end" : "stops at its end";
    } else {
      throw InputError(command + ": a replay knows play, pause, seek, rate, step and loop");
    }
    is_new_ = true;
    run_to(wall);
    return done;
  }

  double position_s(Utime wall) const { return seconds(player_.position(wall)); }
  double length_s() const { return first_run_.length_s(); }

 private:
  static void publish_samples(const RecordedRun& run, Utime start, Sink& sink) {
    sink.reset("samples");
    run.samples([&](const Sample& sample) { sink.add("samples", sample_json(sample, start)); });
  }

  void step(const std::string& channel, Utime wall) {
    if (channel.empty()) {
      player_.step(wall);
    } else {
      player_.step_to(channel, wall);
    }
  }

  void jump(std::size_t place) {
    first_.jump(place);
    is_new_ = true;
  }

  void run_to(Utime wall) {
    player_.run(wall);
    if (player_.finished() != finished_) is_new_ = true;
    finished_ = player_.finished();
    if (player_.position(wall) == position_ && !is_new_) return;
    position_ = player_.position(wall);
    const Utime now = first_run_.index().first() + position_;
    if (second_ != nullptr) {
      second_->follow(now + ahead_);
      first_.view().set_second_ghost(second_->view().estimated_pose(now + ahead_));
    }
    publish(first_.view(), now);
    if (second_ != nullptr) publish(second_->view(), now + ahead_);
    is_new_ = false;
    sink_.set("replay", text_of({{"position_s", rounded(seconds(position_), 1e-3)},
                                 {"length_s", rounded(length_s(), 1e-3)},
                                 {"rate", rounded(player_.rate(), 1e-3)},
                                 {"paused", player_.paused() || player_.finished()},
                                 {"loop", player_.loops()},
                                 {"ahead_s", second_ ? rounded(seconds(ahead_), 1e-3) : Json()}}));
  }

  /// After a step or jump all sections are published at once.
  void publish(CellView& view, Utime now) {
    if (is_new_) {
      view.flush(now);
    } else {
      view.advance(now);
    }
  }

  std::string place(Utime wall) const {
    return fixed(position_s(wall), 3) + " of " + fixed(length_s(), 1) + " s";
  }

  Sink& sink_;
  ReferenceSink reference_sink_;
  RecordedRun first_run_;
  std::unique_ptr<RecordedRun> second_run_;
  ReplayCursor first_;
  std::unique_ptr<ReplayCursor> second_;
  Player player_;
  Utime position_ = 0;
  bool finished_ = false;
  bool is_new_ = true;  // what is shown does not follow what was shown last
  Utime ahead_ = 0;     // times of the second log minus those of the first at the same moment
};

ReplaySource::ReplaySource(const std::filesystem::path& run, const std::filesystem::path& second,
                           const logs::TypeCatalogue& types, Sink& sink, Utime wall,
                           const Progress& progress)
    : impl_(std::make_unique<Impl>(run, second, types, sink, wall, progress)) {}
ReplaySource::~ReplaySource() = default;

std::map<std::string, std::string> ReplaySource::meshes() const { return impl_->meshes(); }
void ReplaySource::run(Utime wall) { impl_->run(wall); }
std::string ReplaySource::obey(const std::string& command, const nlohmann::json& arguments,
                               Utime wall) {
  return impl_->obey(command, arguments, wall);
}
double ReplaySource::position_s(Utime wall) const { return impl_->position_s(wall); }
double ReplaySource::length_s() const { return impl_->length_s(); }

}  // namespace berth::console
