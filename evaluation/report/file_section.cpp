// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>

#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {
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
  HtmlTable table{"ll", {"what the run was made of", "SHA-256"}};
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
