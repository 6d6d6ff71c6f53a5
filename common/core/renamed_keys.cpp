// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/renamed_keys.h"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

#include "common/core/yaml.h"

namespace berth {
namespace {

/// Former paths, and the present last part of each.
constexpr std::pair<std::string_view, std::string_view> renamed_keys[] = {
    {"acquisition.least_elongation", "min_elongation"},
    {"acquisition.least_evidence", "min_evidence"},
    {"acquisition.least_explained", "min_explained"},
    {"acquisition.least_inlier_share", "min_inlier_share"},
    {"acquisition.least_points", "min_points"},
    {"acquisition.most_hypotheses", "max_hypotheses"},
    {"acquisition.most_through", "max_through"},
    {"false_alarms", "family_wise_alpha"},
    {"least_change", "minimum_effect"},
    {"least_intensity", "min_intensity"},
    {"lidar.longest_gap", "max_gap"},
    {"noise.least", "min"},
    {"noise.most", "max"},
    {"receiver.least_echo", "min_echo"},
    {"safety.least_clearance", "min_clearance"},
    {"safety.longest_dead_time", "max_dead_time"},
    {"scan_planner.least_cosine", "min_cosine"},
    {"scan_planner.least_margin", "min_margin"},
    {"scan_planner.least_share_in_view", "min_share_in_view"},
    {"scan_planner.most_windows", "max_windows"},
    {"tracking.bounded_hough.most_points", "max_points"},
    {"tracking.icp.least_gate", "min_gate"},
    {"tracking.least_explained", "min_explained"},
    {"tracking.least_inlier_share", "min_inlier_share"},
    {"tracking.least_used", "min_used"},
    {"tracking.longest_scan", "max_scan_time"},
    {"tracking.most_residual", "max_residual"},
    {"tracking.most_shift", "max_shift"},
    {"tracking.most_through", "max_through"},
    {"tracking.most_turn", "max_turn"},
};

struct Place {
  std::size_t offset = 0;
  Renamed renamed;
};

void find(const YamlNode& node, const std::string& prefix, std::vector<Place>& places) {
  for (const YamlNode& item : node.items()) find(item, prefix, places);
  for (const auto& [key, value] : node.entries()) {
    const std::string path = prefix + key.text();
    if (const auto now = present_name(path)) {
      places.push_back({key.offset(), {key.line(), path, prefix + *now}});
    }
    find(value, path + ".", places);
  }
}

std::size_t last_part(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? 0 : dot + 1;
}

}  // namespace

std::optional<std::string> present_name(const std::string& path) {
  const auto* found = std::find_if(std::begin(renamed_keys), std::end(renamed_keys),
                                   [&](const auto& renamed) { return renamed.first == path; });
  if (found == std::end(renamed_keys)) return std::nullopt;
  return std::string(found->second);
}

std::string with_present_names(const std::string& text, const std::string& name,
                               std::vector<Renamed>* renamed) {
  std::vector<Place> places;
  find(read_yaml(text, name), "", places);
  if (places.empty()) return text;
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.offset < b.offset; });
  const std::string clean = clean_text(text, name);
  std::string result;
  std::size_t at = 0;
  for (const Place& place : places) {
    const std::string& before = place.renamed.before;
    const std::string& now = place.renamed.now;
    // A key may stand in quotes, and one that an alias repeats is renamed once.
    const std::size_t from = clean.find(before.substr(last_part(before)), place.offset);
    if (from == std::string::npos || from < at) continue;
    result += clean.substr(at, from - at) + now.substr(last_part(now));
    at = from + before.size() - last_part(before);
    if (renamed != nullptr) renamed->push_back(place.renamed);
  }
  return result + clean.substr(at);
}

}  // namespace berth
