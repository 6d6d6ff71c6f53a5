// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/cloud.h"

#include <algorithm>
#include <cctype>

#include "common/clouds/cloud_formats.h"
#include "common/clouds/text_lines.h"
#include "common/clouds/text_table.h"
#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::clouds {

namespace {

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool is_text(const std::string& extension) {
  return extension == ".xyz" || extension == ".txt" || extension == ".csv" || extension == ".asc" ||
         extension == ".pts";
}

Cloud cloud_of(const Table& table, const CloudOptions& options) {
  CloudBuilder cloud(table.columns, options);
  for (const CloudRow& row : table.rows) cloud.add(row);
  for (const std::string& text : table.notes) cloud.note(text);
  return cloud.finish();
}

InputError unknown_extension(const std::string& extension, const std::string& file) {
  return InputError(file + ": found '" + extension + "', expected a " + known_extensions() +
                    " cloud");
}

}  // namespace

bool is_cloud(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".pcd" || extension == ".ply" || extension == ".ptx" || is_text(extension);
}

std::string known_extensions() { return ".pcd, .ply, .xyz (.txt, .csv, .asc, .pts) or .ptx"; }

Cloud read_cloud(const std::filesystem::path& path, const CloudOptions& options) {
  if (!is_cloud(path)) throw unknown_extension(extension_of(path), path.string());
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    throw InputError(path.string() + ": no such file");
  }
  return parse_cloud(read_file(path), extension_of(path), path.string(), options);
}

Cloud parse_cloud(std::string bytes, const std::string& extension, const std::string& file,
                  const CloudOptions& options) {
  if (extension == ".pcd") return parse_pcd(bytes, file, options);
  if (extension == ".ply") return parse_ply(bytes, file, options);
  if (extension != ".ptx" && !is_text(extension)) throw unknown_extension(extension, file);
  const std::string text = text_of(std::move(bytes), file);
  if (extension == ".ptx") return parse_ptx(text, file, options);
  return cloud_of(read_text_table(text, file), options);
}

}  // namespace berth::clouds
