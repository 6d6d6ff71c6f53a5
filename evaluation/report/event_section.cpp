// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "common/core/text.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {
namespace {

constexpr std::size_t max_rows = 300;

struct Named {
  const char* name;
  const char* colour;
};

Named severity_of(std::int8_t severity) {
  constexpr Named names[] = {
      {"info", "grey"}, {"notice", ""}, {"warning", "unsure"}, {"ERROR", "bad"}, {"FATAL", "bad"}};
  return severity >= 0 && severity <= event_t::FATAL ? names[severity] : Named{"?", "grey"};
}

Named node_state_of(std::int8_t state) {
  constexpr Named names[] = {{"starting", "grey"},   {"ready", "good"}, {"running", "good"},
                             {"DEGRADED", "unsure"}, {"FAULT", "bad"},  {"stopped", "grey"}};
  return state >= 0 && state <= node_status_t::STOPPED ? names[state] : Named{"?", "grey"};
}

Html changes_of(const RunView& view, const NodeHealth& node) {
  constexpr std::size_t most = 8;
  Html html;
  std::size_t told = 0;
  for (const NodeHealth::Change& change : node.changes) {
    const Named state = node_state_of(change.state);
    if (change.reason.empty() && state.colour != std::string("bad") &&
        state.colour != std::string("unsure")) {
      continue;
    }
    if (++told > most) continue;
    html +=
        element("span", state.colour, text(fixed(view.at(change.utime), 1) + " s " + state.name)) +
        text(change.reason.empty() ? "" : " " + change.reason) + markup("<br>");
  }
  if (told > most) html += text("and " + std::to_string(told - most) + " more");
  return element("small", "", html);
}

Html bad_if(std::int64_t count) {
  return count == 0 ? text("0") : element("b", "bad", text(std::to_string(count)));
}

}  // namespace

Html event_section(const RunView& view) {
  std::vector<const event_t*> events;
  for (const event_t& event : view.record().events()) events.push_back(&event);
  if (events.empty()) return {};
  Html note;
  if (events.size() > max_rows) {
    // The gravest, in order of time.
    std::stable_sort(events.begin(), events.end(),
                     [](const event_t* a, const event_t* b) { return a->severity > b->severity; });
    note = element("p", "note-wide",
                   text("The gravest " + std::to_string(max_rows) + " of " +
                        std::to_string(events.size()) + " events."));
    events.resize(max_rows);
    std::stable_sort(events.begin(), events.end(),
                     [](const event_t* a, const event_t* b) { return a->utime < b->utime; });
  }
  HtmlTable table{"llllll", {"time, s", "severity", "phase", "node", "code", "what"}};
  for (const event_t* event : events) {
    const Named severity = severity_of(event->severity);
    table.rows.push_back({text(fixed(view.at(event->utime), 2)),
                          element("span", severity.colour, text(severity.name)),
                          text(view.phase_at(event->utime)), text(event->node),
                          element("code", "", text(event->code)), text(event->text)});
  }
  return html_of(table) + note;
}

Html node_section(const RunView& view) {
  const auto& nodes = view.details().nodes;
  if (nodes.empty()) return {};
  HtmlTable table{"llll",
                  {"node", "at the end", "what it said", "version", "received", "published",
                   "undecodable", "overflowed", "superseded", "longest silence, s"}};
  for (const auto& [name, node] : nodes) {
    const Named state = node_state_of(node.last.state);
    table.rows.push_back({text(name), element("b", state.colour, text(state.name)),
                          changes_of(view, node), text(node.last.version),
                          text(std::to_string(node.last.received)),
                          text(std::to_string(node.last.published)), bad_if(node.last.undecodable),
                          bad_if(node.last.overflowed), text(std::to_string(node.last.superseded)),
                          text(brief(seconds(node.max_silence), 3))});
  }
  return html_of(table);
}

}  // namespace berth::report
