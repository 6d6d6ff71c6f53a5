// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/run_info.h"

#include <algorithm>

#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/version.h"
#include "evaluation/run/target_surface.h"

namespace berth::procedures {
namespace {

namespace fs = std::filesystem;

/// Leaves room in the 60 kB of a message for everything that is not an attachment's content.
constexpr std::size_t max_content_bytes = 50000;

/// The configuration's files by their names in it, in order, those of its folders last: where there
/// is not room for all, those that describe the whole cell are included. Of layouts and their
/// calibrations only the run's own.
std::vector<fs::path> configuration_files(const RunSetup& setup) {
  std::vector<fs::path> files;
  if (!fs::is_directory(setup.config)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(setup.config)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".yaml") continue;
    const fs::path name = fs::relative(entry.path(), setup.config);
    const bool of_layouts = name.parent_path() == "layouts" || name.parent_path() == "calibration";
    if (of_layouts && name.stem() != setup.layout) continue;
    files.push_back(name);
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return std::pair(a.has_parent_path(), a) < std::pair(b.has_parent_path(), b);
  });
  return files;
}

/// A mesh that the run keeps is named from its directory, wherever that is.
std::string name_from_run(const RunSetup& setup) {
  const fs::path name = fs::path(setup.target).lexically_relative(setup.out);
  const bool inside = !setup.out.empty() && !name.empty() && *name.begin() != "..";
  return inside ? name.generic_string() : setup.target;
}

}  // namespace

run_info_t make_run_info(const Procedure& procedure, const RunSetup& setup, const Target& target,
                         const std::string& run, std::int8_t host,
                         const std::string& configuration_hash) {
  run_info_t info{};
  info.session = setup.session;
  info.run = run;
  info.host = host;
  info.version = version();
  info.seed = static_cast<std::int64_t>(setup.seed);
  info.procedure = procedure.name;
  info.target = name_from_run(setup);
  // The requested length, so that loading the target again gives the same bits.
  info.target_length_m = setup.target_length > 0 ? setup.target_length : target.length;
  info.target_hash = target.hash;
  info.layout = setup.layout;
  info.configuration_hash = configuration_hash;

  std::size_t room = max_content_bytes;
  const auto attach = [&info, &room](const std::string& name, const std::string& content) {
    attachment_t attachment{};
    attachment.name = name;
    attachment.sha256 = sha256(content);
    if (content.size() <= room) {
      attachment.content = content;
      room -= content.size();
    }
    info.attachments.push_back(attachment);
  };
  // First, so that there is room for it: the verdict depends on it.
  const fs::path symmetry = setup.out / evaluation::symmetry_file;
  if (!setup.out.empty() && fs::exists(symmetry))
    attach(evaluation::symmetry_file, read_file(symmetry));
  if (!target.is_bare()) attach(target_file, read_file(target.files.front()));
  attach("procedure.yaml", procedure.text);
  for (const fs::path& file : configuration_files(setup)) {
    attach(file.generic_string(), read_file(setup.config / file));
  }
  info.attachment_count = static_cast<std::int32_t>(info.attachments.size());
  return info;
}

}  // namespace berth::procedures
