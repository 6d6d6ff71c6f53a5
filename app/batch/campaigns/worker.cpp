// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/worker.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <system_error>

#include "app/batch/campaigns/worker_loop.h"
#include "common/core/file.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe");
  }
  return ends;
}

/// What processes print is kept: it may tell why one crashed.
void print_into(const fs::path& file) {
  const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (out < 0) return;
  dup2(out, STDOUT_FILENO);
  dup2(out, STDERR_FILENO);
  close(out);
}

int be_worker(const Campaign& campaign,
              const std::function<std::unique_ptr<Experiment>()>& make_experiment, int blocks,
              int news) {
  signal(SIGINT, SIG_IGN);  // the terminal's: the parent decides
  for (const int number : {SIGTERM, SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS}) {
    signal(number, SIG_DFL);  // whatever the parent does with them
  }
  signal(SIGPIPE, SIG_IGN);
  try {
    print_into(campaign.directory() / "output.txt");
    const auto experiment = make_experiment();
    work(campaign, *experiment, blocks, news);
    return 0;
  } catch (const std::exception& e) {
    std::string text = e.what();
    std::replace(text.begin(), text.end(), '\n', ' ');
    say(news, "error " + text);
    return 2;
  }
}

}  // namespace

fs::path work_directory_of(pid_t worker) {
  return temporary_directory() / ("berth-worker-" + std::to_string(worker));
}

Worker::Worker(const Campaign& campaign,
               const std::function<std::unique_ptr<Experiment>()>& make_experiment) {
  const auto blocks = make_pipe();
  const auto news = make_pipe();
  // What the parent had open is the parent's to close.
  child_.emplace(
      [&] {
        close(blocks[1]);
        close(news[0]);
        return be_worker(campaign, make_experiment, blocks[0], news[1]);
      },
      ChildOptions{});
  close(blocks[0]);
  close(news[1]);
  to_worker_ = blocks[1];
  from_worker_ = news[0];
  fcntl(from_worker_, F_SETFL, O_NONBLOCK);
}

Worker::~Worker() {
  stop();
  finish();
  close(from_worker_);
}

void Worker::finish() {
  if (to_worker_ >= 0) close(to_worker_);
  to_worker_ = -1;
}

void Worker::stop() {
  if (!child_->running()) return;
  child_->signal(SIGKILL);
  reap();
}

void Worker::begin(const Block& block) {
  block_ = block;
  in_block_ = 0;
  say(to_worker_, std::to_string(block.begin) + " " + std::to_string(block.end));
}

bool Worker::listen() {
  std::array<char, 4096> bytes{};
  while (true) {
    const ssize_t n = read(from_worker_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return true;  // nothing for now
    if (n == 0) break;
    heard_.append(bytes.data(), static_cast<std::size_t>(n));
    for (auto end = heard_.find('\n'); end != std::string::npos; end = heard_.find('\n')) {
      take_line(heard_.substr(0, end));
      heard_.erase(0, end + 1);
    }
  }
  reap();
  return false;
}

void Worker::take_line(const std::string& line) {
  if (line == "ready") {
    ready_ = true;
  } else if (line == "trial") {
    ++ran_;
    ++in_block_;
  } else if (line.rfind("had ", 0) == 0) {
    in_block_ = std::stoll(line.substr(4));
  } else if (line == "block") {
    finished_ += block_->size();
    in_block_ = 0;
    block_.reset();
  } else if (line.rfind("error ", 0) == 0) {
    error_ = line.substr(6);
  }
}

void Worker::reap() {
  end_ = child_->wait();
  std::error_code ignored;
  fs::remove_all(work_directory_of(child_->pid()), ignored);
}

}  // namespace berth::campaigns
