// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace berth::console {

/// One text for one viewer, shared with all viewers that were at the same revision.
struct BoardMessage {
  std::uint64_t revision = 0;               ///< what the viewer has when it got the text
  std::shared_ptr<const std::string> text;  ///< null: nothing is newer
};

/// The state of the console, as named sections of JSON (PROTOCOL.md): some are replaced as a whole,
/// some are lists that grow and keep their newest entries. Each change has a revision, so that a
/// viewer can be sent everything newer than what it has, in one message: a slow viewer gets fewer
/// messages, and the newest content all the same.
/// Every function may be called from any thread. Names are plain words; texts are valid JSON: the
/// board pastes them as they are.
class Board {
 public:
  /// How many entries a list keeps unless keep() has set another number.
  static constexpr std::size_t default_kept = 1000;

  /// Replaces a section. The text that is there already changes nothing and costs viewers nothing.
  void set(const std::string& section, std::string json);
  /// Appends an entry to a list; the oldest goes when the list is full.
  void add(const std::string& list, std::string json);
  /// Empties a list, here and on every page.
  void reset(const std::string& list);
  /// How many entries a list keeps. Call before the first add().
  void keep(const std::string& list, std::size_t entries);

  /// The time that messages carry: in the cell, or of a replay in its log, us. No change by itself.
  void at(std::int64_t utime);

  std::uint64_t revision() const;
  /// Everything newer than the revision; of 0, all there is, and lists are then reset first, since
  /// a page that joins again may hold old entries.
  BoardMessage message_since(std::uint64_t revision) const;
  /// The same for several viewers at one moment: all come to the same revision, and those that
  /// start from the same one share a text.
  std::vector<BoardMessage> messages_since(const std::vector<std::uint64_t>& revisions) const;
  /// A message that brings nothing but the time: a sign of life where nothing changes.
  std::string time_alone() const;

 private:
  struct Section {
    std::uint64_t revision = 0;
    std::string json;
  };
  struct List {
    std::size_t kept = default_kept;
    std::uint64_t reset = 0;  // the revision at which it was emptied last
    std::deque<Section> entries;
  };

  BoardMessage newest(std::uint64_t since) const;
  std::string text_since(std::uint64_t since) const;
  std::string head() const;

  mutable std::mutex mutex_;
  std::uint64_t revision_ = 0;
  std::int64_t utime_ = 0;
  std::map<std::string, Section> sections_;
  std::map<std::string, List> lists_;
  /// Texts that lead to revision_, by where they start.
  mutable std::map<std::uint64_t, std::shared_ptr<const std::string>> texts_;
};

}  // namespace berth::console
