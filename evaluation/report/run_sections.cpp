// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>

#include "common/core/text.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"
#include "evaluation/run/outcome.h"
#include "lcmtypes/words.h"

namespace berth::report {
namespace {

const char* class_of_state(std::int8_t state) {
  switch (state) {
    case procedure_step_t::PASSED:
      return "good";
    case procedure_step_t::FAILED:
    case procedure_step_t::ERROR:
    case procedure_step_t::TIMEOUT:
      return "bad";
    case procedure_step_t::RUNNING:
    case procedure_step_t::ABORTED:
      return "unsure";
    default:
      return "grey";
  }
}

Html bar_of(const procedure_step_t& step, Utime begin, Utime end, Utime last, const char* colour) {
  if (step.utime_start == 0 || last <= begin) return {};
  const auto part = [&](Utime t) {
    return static_cast<double>(t - begin) / static_cast<double>(last - begin);
  };
  const std::string style = style_along(part(step.utime_start), part(end));
  return element("div", "track", element("i", {{"class", colour}, {"style", style}}, {}));
}

}  // namespace

Html step_section(const RunView& view) {
  const auto* state = view.record().state();
  if (!state || state->steps.empty()) return {};
  Utime last = state->utime;
  for (const procedure_step_t& step : state->steps) last = std::max(last, step.utime_end);
  Table table{"llll", {"state", "step", "phase", "", "from, s", "lasted, s"}};
  for (const procedure_step_t& step : state->steps) {
    const char* colour = class_of_state(step.state);
    const Utime end = step.utime_end != 0 ? step.utime_end : state->utime;
    Html what =
        markup("<span style=\"padding-left:" + std::to_string(std::max<int>(0, step.depth)) +
               "em\">") +
        text(step.name) + markup("</span>");
    if (step.attempts > 1) {
      what += element("small", "", text(" " + std::to_string(step.attempts) + " attempts"));
    }
    if (!step.detail.empty()) what += markup("<br>") + element("small", "", text(step.detail));
    const bool ran = step.utime_start != 0;
    table.rows.push_back({element("b", colour, text(words::of_step_state(step.state))), what,
                          text(step.phase), bar_of(step, view.start(), end, last, colour),
                          ran ? text(brief(view.at(step.utime_start))) : Html(),
                          ran ? text(brief(seconds(end - step.utime_start))) : Html()});
  }
  return html_of(table);
}

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
  constexpr std::size_t max_shown = 8;
  Html html;
  std::size_t shown_count = 0;
  for (const NodeHealth::Change& change : node.changes) {
    const Named state = node_state_of(change.state);
    if (change.reason.empty() && state.colour != std::string("bad") &&
        state.colour != std::string("unsure")) {
      continue;
    }
    if (++shown_count > max_shown) continue;
    html +=
        element("span", state.colour, text(fixed(view.at(change.utime), 1) + " s " + state.name)) +
        text(change.reason.empty() ? "" : " " + change.reason) + markup("<br>");
  }
  if (shown_count > max_shown)
    html += text("and " + std::to_string(shown_count - max_shown) + " more");
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
  Table table{"llllll", {"time, s", "severity", "phase", "node", "code", "what"}};
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
  Table table{"llll",
              {"node", "at the end", "states and reasons", "version", "received", "published",
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

namespace {

namespace fs = std::filesystem;

std::string size_of(std::uintmax_t bytes) {
  if (bytes < 10000) return std::to_string(bytes) + " B";
  const double kilobytes = 1e-3 * static_cast<double>(bytes);
  return kilobytes < 10000 ? brief(kilobytes, 3) + " kB" : brief(1e-3 * kilobytes, 3) + " MB";
}

Html directory_of(const fs::path& directory, const fs::path& page) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  const fs::path from = fs::absolute(page).parent_path();
  Html list;
  for (const fs::path& file : files) {
    if (file.extension() == ".part" || file == fs::absolute(page)) continue;
    const bool folder = fs::is_directory(file, error);
    const std::string name = file.filename().string() + (folder ? "/" : "");
    const std::string address = fs::absolute(file).lexically_relative(from).string();
    list += element(
        "li", "",
        link(address + (folder ? "/" : ""), text(name)) +
            (folder ? Html()
                    : element("small", "", text(" " + size_of(fs::file_size(file, error))))));
  }
  return list.empty() ? Html() : element("ul", "files", list);
}

}  // namespace

Html file_section(const RunView& view, const fs::path& page) {
  Html html;
  if (!view.source().directory.empty()) {
    html += directory_of(view.source().directory, page);
  } else {
    const fs::path log = fs::absolute(view.source().log);
    html += element("p", "",
                    link(log.lexically_relative(fs::absolute(page).parent_path()).string(),
                         text(log.filename().string())));
  }
  const auto* info = view.record().info();
  if (!info) return html;
  Table table{"ll", {"what the run was made of", "SHA-256"}};
  const auto add = [&table](const std::string& name, const std::string& hash) {
    if (!hash.empty()) table.rows.push_back({text(name), element("code", "", text(hash))});
  };
  add("configuration, all of it", info->configuration_hash);
  add("target " + info->target, info->target_hash);
  for (const attachment_t& attachment : info->attachments) add(attachment.name, attachment.sha256);
  return html + markup("<details><summary>Hashes of what the run was made of</summary>") +
         html_of(table) + markup("</details>");
}

}  // namespace berth::report
