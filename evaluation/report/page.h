// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "evaluation/report/html.h"

namespace berth::report {

/// One self-contained HTML file: style and script inside, nothing fetched. Reads without script,
/// in light and dark, narrow and on paper.
class Page {
 public:
  explicit Page(std::string title) : title_(std::move(title)) {}

  /// Above the sections, across the whole width.
  void head(const Html& content) { head_ += content; }
  /// A section with a heading, listed in the page's contents. id: a word of letters, digits and
  /// '-', once in a page.
  void section(const std::string& id, const std::string& heading, const Html& content);

  Html html() const;
  /// Writes beside the file and renames: a reader never sees half a page.
  /// @throws InputError when it cannot be written.
  void write(const std::filesystem::path& file) const;

 private:
  std::string title_;
  Html head_;
  Html contents_;
  Html sections_;
};

}  // namespace berth::report
