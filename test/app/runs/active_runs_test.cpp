// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/active_runs.h"

#include <stdlib.h>
#include <unistd.h>

#include <optional>
#include <string>

#include "common/core/error.h"
#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using Catch::Matchers::Contains;

namespace {

/// An environment variable for one test.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Variable() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }

 private:
  const char* name_;
  std::optional<std::string> before_;
};

}  // namespace

TEST_CASE("a run is listed as long as its supervisor holds the lock") {
  const TemporaryDirectory folder;
  const Variable runtime("XDG_RUNTIME_DIR", folder / "");
  CHECK(active_runs().empty());
  {
    const ActiveRunEntry entry(folder / "runs/one", "udpm://x");
    const auto run = find_active_run(folder / "runs/one/");
    REQUIRE(run);
    CHECK(run->supervisor == getpid());
    CHECK(run->url == "udpm://x");
    CHECK(is_active(*run));
  }
  CHECK(active_runs().empty());
  CHECK_THROWS_WITH(require_active_run(), Contains("nothing is running"));
}

TEST_CASE("an entry left behind is no run, though its process number is in use again") {
  const TemporaryDirectory folder;
  const Variable runtime("XDG_RUNTIME_DIR", folder / "");
  std::filesystem::create_directories(folder / "berth");
  const std::filesystem::path left = folder / ("berth/" + std::to_string(getppid()));
  write_file(left, "/runs/old\nudpm://x\n");
  write_file(folder / "berth/note.txt", "not an entry\nof ours\n");
  CHECK(active_runs().empty());
  CHECK_FALSE(std::filesystem::exists(left));
  CHECK(std::filesystem::exists(folder / "berth/note.txt"));
}

TEST_CASE("a list that cannot be kept is refused at the start, and is no run's end") {
  const TemporaryDirectory folder;
  const Variable runtime("XDG_RUNTIME_DIR", folder / "");
  write_file(folder / "berth", "a file where the folder should be");
  CHECK(active_runs().empty());
  CHECK_THROWS_WITH(ActiveRunEntry(folder / "runs/one", "udpm://x"),
                    Contains("berth: ") && Contains("XDG_RUNTIME_DIR"));
  if (getuid() != 0) return;  // only root can give a folder away
  std::filesystem::remove(folder / "berth");
  std::filesystem::create_directories(folder / "berth");
  REQUIRE(chown((folder / "berth").c_str(), 1, 1) == 0);
  CHECK_THROWS_WITH(ActiveRunEntry(folder / "runs/one", "udpm://x"), Contains("another user"));
}

TEST_CASE("a missing temporary folder is an error with an explanation") {
  const Variable temporary("TMPDIR", "/nowhere/at/all");
  CHECK_THROWS_WITH(temporary_directory(),
                    Contains("/nowhere/at/all") && Contains("set TMPDIR to one that is there"));
}
