// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/contents.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"

namespace berth::console {
namespace fs = std::filesystem;
namespace {

std::string type_of(const fs::path& file) {
  static const std::map<std::string, std::string> types{
      {".css", "text/css; charset=utf-8"},
      {".html", "text/html; charset=utf-8"},
      {".ico", "image/x-icon"},
      {".js", "text/javascript; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".png", "image/png"},
      {".svg", "image/svg+xml"},
      {".txt", "text/plain; charset=utf-8"},
      {".woff2", "font/woff2"},
  };
  const auto found = types.find(file.extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-' || c == '/';
}

}  // namespace

bool is_plain_path(const std::string& path) {
  return !path.empty() && path.front() == '/' && std::all_of(path.begin(), path.end(), is_plain) &&
         path.find("/.") == std::string::npos && path.find("//") == std::string::npos;
}

Contents::Contents(std::map<std::string, fs::path> directories)
    : directories_(std::move(directories)) {
  for (const auto& [path, directory] : directories_) {
    if (!fs::is_directory(directory)) {
      throw InputError("directory " + directory.string() + ", served at " + path +
                       ": it is not there");
    }
  }
}

void Contents::offer(const std::string& path, const std::string& type, std::string bytes) {
  std::string tag = sha256(bytes).substr(0, 16);
  Content content{type, std::move(tag), std::make_shared<const std::string>(std::move(bytes))};
  const std::lock_guard lock(mutex_);
  offered_[path] = std::move(content);
}

std::optional<Content> Contents::find(const std::string& path) const {
  if (!is_plain_path(path)) return std::nullopt;
  {
    const std::lock_guard lock(mutex_);
    const auto found = offered_.find(path);
    if (found != offered_.end()) return found->second;
  }
  return file(path);
}

std::optional<Content> Contents::file(const std::string& path) const {
  // Of the directories, the one with the longest path that fits.
  const auto fits = [&path](const auto& entry) { return path.rfind(entry.first, 0) == 0; };
  const auto found = std::find_if(directories_.rbegin(), directories_.rend(), fits);
  if (found == directories_.rend()) return std::nullopt;
  fs::path file = found->second / path.substr(found->first.size());
  if (path.back() == '/') file /= "index.html";
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  const auto changed = fs::last_write_time(file, error).time_since_epoch().count();
  auto bytes = std::make_shared<const std::string>(read_file(file));
  return Content{type_of(file), std::to_string(changed) + "-" + std::to_string(bytes->size()),
                 std::move(bytes)};
}

}  // namespace berth::console
