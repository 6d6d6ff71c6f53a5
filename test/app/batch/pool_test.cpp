// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/pool.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <stdexcept>

#include "app/batch/shared_values.h"
#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;

namespace {

/// Ends when `count` of its kind have begun: it proves that so many run at a time.
Task meeting(std::atomic<int>& begun, int count) {
  Task task;
  task.body = [&begun, count] {
    for (++begun; begun < count;) usleep(1000);
    return 0;
  };
  task.ended = [](const TaskEnd&) {};
  return task;
}

PoolOptions jobs(int count) { return {count, 0, {}, {}}; }

}  // namespace

TEST_CASE("a batch: as many tasks at a time as requested, in their order") {
  SharedValues<std::atomic<int>> begun(1);
  Pool together(jobs(3));
  for (int i = 0; i < 3; ++i) together.add(meeting(begun[0], 3));
  together.run();
  CHECK(begun[0] == 3);

  std::vector<int> order;
  std::size_t concurrent = 0;
  Pool one(jobs(1));
  for (int i = 0; i < 4; ++i) {
    Task task;
    task.body = [] { return 0; };
    task.ended = [&, i](const TaskEnd&) {
      order.push_back(i);
      concurrent += one.running();
      if (i == 0) {
        Task next = meeting(begun[0], 1);
        next.ended = [&](const TaskEnd&) { order.push_back(10); };
        one.add_first(std::move(next));
      }
    };
    one.add(std::move(task));
  }
  one.run();
  CHECK(order == std::vector<int>{0, 10, 1, 2, 3});
  CHECK(concurrent == 0);
}

TEST_CASE("a batch: what crashes, fails or lasts too long ends nothing but itself") {
  const TemporaryDirectory directory;
  std::vector<TaskEnd> ends(5);
  Pool pool(jobs(2));
  const auto add = [&](std::size_t i, Task task) {
    task.output = directory / std::to_string(i);
    task.ended = [&ends, i](const TaskEnd& end) { ends[i] = end; };
    pool.add(std::move(task));
  };
  Task crash;
  crash.body = [] {
    signal(SIGSEGV, SIG_DFL);
    return raise(SIGSEGV);
  };
  Task forever;
  forever.body = [] { return pause(); };
  forever.time_limit_s = 0.05;
  Task failure;
  failure.program = {"sh", "-c", "echo why; exit 3"};
  Task exception;
  exception.body = [] { throw std::runtime_error("why not"); };
  Task success;
  success.program = {"true"};
  add(0, std::move(crash));
  add(1, std::move(forever));
  add(2, std::move(failure));
  add(3, std::move(success));
  add(4, std::move(exception));
  pool.run();
  CHECK(ends[0].process.name() == "SIGSEGV");
  CHECK_FALSE(ends[0].too_long);
  CHECK(ends[1].process.signal == SIGKILL);
  CHECK(ends[1].too_long);
  CHECK(ends[2].process.code() == 3);
  CHECK(read_file(directory / "2") == "why\n");
  CHECK(ends[3].process.ok());
  CHECK_FALSE(ends[3].interrupted);
  CHECK(ends[3].error.empty());
  CHECK(ends[4].error == "why not");
  CHECK_FALSE(ends[4].process.ok());
}

TEST_CASE("a batch: a task that must run alone has no other next to it") {
  SharedValues<std::atomic<int>> running(1);
  std::vector<int> seen;
  Pool pool(jobs(3));
  SharedValues<std::atomic<bool>> concurrent(1);
  for (int i = 0; i < 5; ++i) {
    Task task;
    task.alone = i == 2;
    task.body = [&, alone = task.alone] {
      ++running[0];
      for (int look = 0; look < 20; ++look) {
        if (alone && running[0] > 1) concurrent[0] = true;
        usleep(1000);
      }
      --running[0];
      return 0;
    };
    task.ended = [&seen, i](const TaskEnd&) { seen.push_back(i); };
    pool.add(std::move(task));
  }
  pool.run();
  CHECK(seen.size() == 5);
  CHECK(seen[2] == 2);
  CHECK_FALSE(concurrent[0]);
}

TEST_CASE("a batch that is interrupted, or of which a task throws, leaves no process behind") {
  for (const bool throws : {false, true}) {
    SharedValues<std::atomic<int>> begun(1);
    std::vector<TaskEnd> ends;
    PoolOptions options = jobs(2);
    options.interrupted = [&] { return !throws && begun[0] == 2; };
    Pool pool(options);
    for (int i = 0; i < 3; ++i) {
      Task task;
      task.body = [&begun, throws, i] {
        for (++begun[0]; begun[0] < 2;) usleep(1000);
        return throws && i == 0 ? 0 : pause();
      };
      task.ended = [&, throws](const TaskEnd& end) {
        ends.push_back(end);
        if (throws && !end.interrupted) throw std::runtime_error("enough");
      };
      pool.add(std::move(task));
    }
    if (throws) {
      CHECK_THROWS_WITH(pool.run(), "enough");
    } else {
      pool.run();
    }
    REQUIRE(ends.size() == 2);
    CHECK(ends.back().interrupted);
    CHECK(pool.running() == 0);
    for (const TaskEnd& end : ends) CHECK(kill(end.pid, 0) != 0);
  }
}
