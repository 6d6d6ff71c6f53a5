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
  /// Its path for messages.
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
/// @throws InputError for a reference to neither a parameter nor a sweep.
Source make_source(const std::string& text, const std::string& file, const std::string& name,
                   const Overrides& overrides);

/// A trajectory that was read from elsewhere (a CSV file, an earlier run) becomes a part of the
/// procedure's own text, as a called procedure does: a run can be repeated and judged anywhere.
/// @{
/// Before a step is read: attached texts replace the files that it names.
void give_attached(const Config& step, const Source& source, const Library& library);
/// After it was read: the texts that it read are attached.
void keep_attached(const Config& step, const Source& source, Library& library);
/// @}

/// The key of a rule's attached text.
inline constexpr const char* attached_key = "attached";

}  // namespace berth::procedures
