// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "procedures/language/parameters.h"

namespace berth::procedures {

/// The other files of a procedure, those that it calls and trajectories: read from the folder
/// of the one that runs, or found attached to its text. Names are paths relative to that folder.
class Library {
 public:
  explicit Library(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void attach(const std::string& name, const std::string& text) { texts_[name] = text; }
  /// @throws InputError when there is none.
  const std::string& text(const std::string& name);
  /// How it is called in messages.
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  /// All that were requested or attached.
  const std::map<std::string, std::string>& texts() const { return texts_; }

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::string> texts_;
};

/// A procedure with its parameters filled in, and where it comes from.
struct Source {
  std::string text;
  YamlNode tree;                     ///< of the text; references to sweeps stand in it as $<name>
  std::string file;                  ///< in messages
  std::string name;                  ///< in the library
  bool as_run = false;               ///< its parameters were filled in when it was run
  std::vector<std::string> callers;  ///< names of those that called it
};

/// Fills in the parameters of a procedure's text.
/// @throws InputError for a reference that neither a parameter nor a sweep has the name of.
Source make_source(const std::string& text, const std::string& file, const std::string& name,
                   const Overrides& overrides);

/// A trajectory that was read from elsewhere (a CSV file, an earlier run) becomes a part of the
/// procedure's own text, as a called procedure does: what was run can be run and judged anywhere.
/// @{
/// Before a step is read: what is attached takes the place of what it names.
void give_attached(const Config& step, const Source& source, const Library& library);
/// After it was read: what it read is attached.
void keep_attached(const Config& step, const Source& source, Library& library);
/// @}

/// The key under which a rule finds its text, and leaves it.
inline constexpr const char* attached_key = "attached";

}  // namespace berth::procedures
