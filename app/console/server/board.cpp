// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/board.h"

#include <algorithm>
#include <utility>

namespace berth::console {
namespace {

/// Parts of a JSON object or array, with commas between them.
class Parts {
 public:
  void add(const std::string& part) {
    if (!text_.empty()) text_ += ',';
    text_ += part;
  }
  void add(const std::string& name, const std::string& json) {
    if (!text_.empty()) text_ += ',';
    text_.append("\"").append(name).append("\":").append(json);
  }
  bool empty() const { return text_.empty(); }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace

void Board::set(const std::string& section, std::string json) {
  const std::lock_guard lock(mutex_);
  Section& there = sections_[section];
  if (there.json == json) return;
  texts_.clear();
  there = {++revision_, std::move(json)};
}

void Board::add(const std::string& list, std::string json) {
  const std::lock_guard lock(mutex_);
  texts_.clear();
  List& there = lists_[list];
  there.entries.push_back({++revision_, std::move(json)});
  while (there.entries.size() > there.kept) there.entries.pop_front();
}

void Board::reset(const std::string& list) {
  const std::lock_guard lock(mutex_);
  texts_.clear();
  List& there = lists_[list];
  there.reset = ++revision_;
  there.entries.clear();
}

void Board::keep(const std::string& list, std::size_t entries) {
  const std::lock_guard lock(mutex_);
  lists_[list].kept = entries;
}

void Board::at(std::int64_t utime) {
  const std::lock_guard lock(mutex_);
  utime_ = utime;
}

std::uint64_t Board::revision() const {
  const std::lock_guard lock(mutex_);
  return revision_;
}

BoardMessage Board::message_since(std::uint64_t revision) const {
  const std::lock_guard lock(mutex_);
  return newest(revision);
}

std::vector<BoardMessage> Board::messages_since(const std::vector<std::uint64_t>& revisions) const {
  const std::lock_guard lock(mutex_);
  std::vector<BoardMessage> messages;
  messages.reserve(revisions.size());
  for (const std::uint64_t revision : revisions) messages.push_back(newest(revision));
  return messages;
}

std::string Board::time_alone() const {
  const std::lock_guard lock(mutex_);
  return head() + '}';
}

std::string Board::head() const {
  return R"({"type":"board","revision":)" + std::to_string(revision_) +
         ",\"utime\":" + std::to_string(utime_);
}

BoardMessage Board::newest(std::uint64_t since) const {
  if (since >= revision_) return {since, nullptr};
  auto& text = texts_[since];
  if (text == nullptr) text = std::make_shared<const std::string>(text_since(since));
  return {revision_, text};
}

std::string Board::text_since(std::uint64_t since) const {
  Parts set;
  for (const auto& [name, section] : sections_) {
    if (section.revision > since) set.add(name, section.json);
  }
  Parts added;
  Parts emptied;
  for (const auto& [name, list] : lists_) {
    if (since == 0 || list.reset > since) emptied.add('"' + name + '"');
    const auto first = std::upper_bound(
        list.entries.begin(), list.entries.end(), since,
        [](std::uint64_t revision, const Section& entry) { return revision < entry.revision; });
    Parts entries;
    std::for_each(first, list.entries.end(),
                  [&](const Section& entry) { entries.add(entry.json); });
    if (!entries.empty()) added.add(name, '[' + entries.text() + ']');
  }
  std::string text = head();
  if (!set.empty()) text += ",\"set\":{" + set.text() + '}';
  if (!added.empty()) text += ",\"add\":{" + added.text() + '}';
  if (!emptied.empty()) text += ",\"reset\":[" + emptied.text() + ']';
  return text + '}';
}

}  // namespace berth::console
