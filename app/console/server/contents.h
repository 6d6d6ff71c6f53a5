// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace berth::console {

/// What is served at one path.
struct Content {
  std::string type;  ///< "text/html; charset=utf-8"
  std::string tag;   ///< differs when the bytes differ
  std::shared_ptr<const std::string> bytes;
};

/// Whether a path is one that our pages request: plain letters, no part that begins with a dot,
/// nothing encoded. Any other may be meant to leave the directories.
bool is_plain_path(const std::string& path);

/// The files and made contents that the server has, by path. From any thread.
class Contents {
 public:
  /// Directories by where they are served, e.g. {"/", page}, {"/lib/three/", ...}. A path that ends
  /// in '/' is its index.html. @throws InputError for a directory that is not there
  explicit Contents(std::map<std::string, std::filesystem::path> directories);

  void offer(const std::string& path, const std::string& type, std::string bytes);
  /// Nothing where there is no such content, or the path is not plain.
  std::optional<Content> find(const std::string& path) const;

 private:
  std::optional<Content> file(const std::string& path) const;

  std::map<std::string, std::filesystem::path> directories_;
  mutable std::mutex mutex_;
  std::map<std::string, Content> offered_;
};

}  // namespace berth::console
