// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/hub.h"

#include <nlohmann/json.hpp>

#include "common/core/valid_text.h"
#include "common/core/version.h"

namespace berth::console {

Hub::Hub(const ServerOptions& with, const Board& of)
    : options(with),
      access(with.token, with.hosts, !with.certificate.empty()),
      contents(with.files),
      board_(of) {}

std::string Hub::join(const std::shared_ptr<ViewerLink>& link, const std::string& from) {
  const std::string name = "viewer-" + std::to_string(++last_viewer_);
  viewers_[name].link = link;
  viewer_count_ = static_cast<std::int64_t>(viewers_.size());
  const nlohmann::json hello{{"type", "hello"},
                             {"viewer", name},
                             {"mode", options.mode},
                             {"may_command", options.may_command},
                             {"version", std::string(version())}};
  link->send(std::make_shared<const std::string>(json_text(hello)));
  inbox.put({Incoming::Kind::joined, name, {}, "", from});
  return name;
}

void Hub::leave(const std::string& viewer) {
  if (viewers_.erase(viewer) == 0) return;
  viewer_count_ = static_cast<std::int64_t>(viewers_.size());
  inbox.put({Incoming::Kind::left, viewer, {}, "", ""});
}

void Hub::command(const std::string& viewer, Command command) {
  command.viewer = viewer;
  const std::int64_t id = command.id;
  if (!options.may_command) {
    return answer(viewer, {id, false, "this console only shows", ""});
  }
  if (!inbox.put({Incoming::Kind::command, viewer, std::move(command), "", ""})) {
    answer(viewer, {id, false, "the console is busy", ""});
  }
}

void Hub::answer(const std::string& viewer, const Answer& answer) {
  const auto found = viewers_.find(viewer);
  if (found == viewers_.end()) return;
  if (const auto link = found->second.link.lock()) {
    link->send(std::make_shared<const std::string>(to_json(answer)));
  }
}

void Hub::send_frames() {
  inbox.report_more();
  std::vector<std::pair<Viewer*, std::shared_ptr<ViewerLink>>> ready;
  std::vector<std::uint64_t> revisions;
  for (auto& [name, viewer] : viewers_) {
    auto link = viewer.link.lock();
    if (link == nullptr) continue;
    if (!link->idle()) {
      ++late_frames_;
      continue;
    }
    ready.emplace_back(&viewer, std::move(link));
    revisions.push_back(viewer.revision);
  }
  const auto messages = board_.messages_since(revisions);
  for (std::size_t i = 0; i < ready.size(); ++i) {
    auto& [viewer, link] = ready[i];
    viewer->revision = messages[i].revision;
    if (messages[i].text != nullptr) {
      viewer->turns_without_news = 0;
      link->send(messages[i].text);
    } else if (++viewer->turns_without_news >= options.frames_per_s) {
      viewer->turns_without_news = 0;
      link->send(std::make_shared<const std::string>(board_.time_alone()));
    }
  }
}

void Hub::close_all() {
  for (auto& [name, viewer] : viewers_) {
    if (const auto link = viewer.link.lock()) link->close_going_away();
  }
}

void Hub::sent(std::size_t bytes) {
  ++messages_;
  bytes_ += static_cast<std::int64_t>(bytes);
}

ServerCounters Hub::counters() const {
  return {viewer_count_, messages_, bytes_, late_frames_, inbox.refused()};
}

}  // namespace berth::console
