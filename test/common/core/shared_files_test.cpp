// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/shared_files.h"

#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

namespace berth {
namespace {

namespace fs = std::filesystem;

/// In another working directory while it lives.
class WorkingDirectory {
 public:
  explicit WorkingDirectory(const fs::path& path) { fs::current_path(path); }
  ~WorkingDirectory() { fs::current_path(before_); }
  WorkingDirectory(const WorkingDirectory&) = delete;
  WorkingDirectory& operator=(const WorkingDirectory&) = delete;

 private:
  fs::path before_ = fs::current_path();
};

}  // namespace

TEST_CASE("What is shipped is found from anywhere, after what is there") {
  const TemporaryDirectory folder;
  const WorkingDirectory there(folder.path());
  const fs::path name = "procedures/approach.yaml";
  CHECK(here_or_shipped(name) == shared_files() / name);
  CHECK(here_or_shipped("procedures") == shared_files() / "procedures");
  CHECK(here_or_shipped("procedures/none.yaml") == "procedures/none.yaml");
  CHECK(here_or_shipped("/procedures") == "/procedures");
  CHECK(here_or_shipped("").empty());
  fs::create_directory("procedures");
  write_file(name, "steps: []\n");
  CHECK(here_or_shipped(name) == name);
}

TEST_CASE("Copies of what is for reading alone may be written, again, too") {
  const TemporaryDirectory folder;
  const fs::path from = folder.path() / "from";
  const fs::path to = folder.path() / "to";
  fs::create_directories(from / "layouts");
  write_file(from / "layouts" / "free.yaml", "one");
  constexpr auto writing = fs::perms::owner_write;
  for (const char* part : {"layouts/free.yaml", "layouts", ""}) {
    fs::permissions(from / part, writing, fs::perm_options::remove);
  }
  copy_writable(from, to);
  copy_writable(from, to);
  CHECK(read_file(to / "layouts" / "free.yaml") == "one");
  for (const char* part : {"layouts/free.yaml", "layouts", ""}) {
    INFO(part);
    CHECK((fs::status(to / part).permissions() & writing) == writing);
  }
  for (const char* part : {"", "layouts"}) {  // so that it can be removed
    fs::permissions(from / part, writing, fs::perm_options::add);
  }
}

}  // namespace berth
