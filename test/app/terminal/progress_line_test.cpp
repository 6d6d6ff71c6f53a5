// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/progress_line.h"

#include <pty.h>
#include <unistd.h>

#include "test/catch.h"

using namespace berth::terminal;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;

namespace {

/// Two ends: what is written into one is read from the other. The clock is set by the test.
class Ends {
 public:
  enum class Kind { terminal, pipe };
  explicit Ends(Kind kind) {
    int ends[2];
    winsize size{};
    size.ws_row = 24;
    size.ws_col = 40;
    const int failed =
        kind == Kind::terminal ? openpty(&ends[0], &ends[1], nullptr, nullptr, &size) : pipe(ends);
    REQUIRE(failed == 0);
    from_ = ends[0];
    file_ = fdopen(ends[1], "w");
  }
  ~Ends() {
    std::fclose(file_);
    close(from_);
  }
  Ends(const Ends&) = delete;
  Ends& operator=(const Ends&) = delete;

  ProgressOutput output() {
    return {file_, file_, [this] { return now_s; }};
  }

  /// What was written since: all that is read before a mark that follows it.
  std::string written() const {
    constexpr char mark = '\x1e';
    std::fputc(mark, file_);
    std::fflush(file_);
    std::string text;
    for (char next = 0; read(from_, &next, 1) == 1 && next != mark;) text += next;
    return text;
  }

  double now_s = 1000;

 private:
  int from_;
  std::FILE* file_;
};

struct OnTerminal {
  Ends terminal{Ends::Kind::terminal};
};

struct OnPipe {
  Ends pipe{Ends::Kind::pipe};
};

}  // namespace

TEST_CASE_METHOD(OnTerminal,
                 "a terminal has one line, rewritten in place, and none when the work is over") {
  {
    ProgressLine line("runs", 9, terminal.output());
    terminal.now_s += 4;
    line.show(2);
    CHECK(terminal.written() == "\r2 of 9 runs; 0:04 elapsed, about 0:14 t\x1b[K");  // cut
    line.show(2);
    CHECK(terminal.written().empty());
    line.print("FAIL approach seed 3");
    CHECK_THAT(terminal.written(), Contains("\r\x1b[KFAIL approach seed 3\r\n\r2 of 9 runs"));
    line.status("plays");
    CHECK(terminal.written() == "\rplays\x1b[K");
  }
  CHECK(terminal.written() == "\r\x1b[K");
}

TEST_CASE_METHOD(OnTerminal, "on a terminal a share is shown from its second second on") {
  {
    ProgressLine line("run.lcm", terminal.output());
    line.show(0.5);
  }
  CHECK(terminal.written().empty());
  ProgressLine line("run.lcm", terminal.output());
  terminal.now_s += 3;
  line.show(0.25);
  CHECK_THAT(terminal.written(), Contains("\rrun.lcm: 25 %; 0:03 elapsed, about 0:09"));
}

TEST_CASE_METHOD(OnTerminal,
                 "a terminal is written to four times a second, and at once where less is done") {
  ProgressLine line("trials", 5000, terminal.output());
  terminal.now_s += 2;
  line.show(1);
  line.show(2);
  CHECK_THAT(terminal.written(), Contains("\r1 of 5000") && Contains("\r2 of 5000"));
  line.show(1000);
  CHECK(terminal.written().empty());
  terminal.now_s += 0.25;
  line.show(1001);
  CHECK_THAT(terminal.written(), Contains("\r1001 of 5000"));
}

TEST_CASE_METHOD(OnPipe,
                 "elsewhere there is a whole line for each twentieth part, and one a minute") {
  ProgressLine line("trials", 200, pipe.output());
  for (int done = 1; done < 10; ++done) line.show(done);
  CHECK(pipe.written().empty());
  pipe.now_s += 5;
  line.show(10, "2 workers");
  CHECK(pipe.written() ==
        "10 of 200 trials, 2.0 a second, 2 workers; 0:05 elapsed, about 1:35 to go\n");
  pipe.now_s += 59;
  line.show(11);
  CHECK(pipe.written().empty());
  pipe.now_s += 1;
  line.show(12);
  CHECK_THAT(pipe.written(), Contains("12 of 200 trials; 1:05 elapsed") && EndsWith("to go\n"));
  line.show(200);
  CHECK_THAT(pipe.written(), Contains("200 of 200 trials") && EndsWith("elapsed\n"));
  line.print("lasting");
  line.status("plays");
  CHECK(pipe.written() == "lasting\n");
}

TEST_CASE_METHOD(OnPipe, "work done before does not count for the time to go") {
  ProgressLine line("runs", 10, pipe.output());
  pipe.now_s += 10;
  line.show(6, "0 did not pass", 5);
  CHECK(pipe.written() == "6 of 10 runs, 0 did not pass; 0:10 elapsed, about 0:40 to go\n");
}

TEST_CASE_METHOD(OnPipe, "elsewhere a share has a line a minute") {
  ProgressLine line("run.lcm", pipe.output());
  pipe.now_s += 59;
  line.show(0.4);
  CHECK(pipe.written().empty());
  pipe.now_s += 1;
  line.show(0.5);
  CHECK(pipe.written() == "run.lcm: 50 %; 1:00 elapsed, about 1:00 to go\n");
}

TEST_CASE("nothing to do is no fault") {
  Ends pipe(Ends::Kind::pipe);
  Ends terminal(Ends::Kind::terminal);
  ProgressLine(std::string("runs"), 0, pipe.output()).show(0);
  CHECK(pipe.written().empty());
  ProgressLine(std::string("runs"), 0, terminal.output()).show(0);
  CHECK(terminal.written() == "\r0 of 0 runs; 0:00 elapsed\x1b[K\r\x1b[K");
}
