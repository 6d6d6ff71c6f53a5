// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/worker.h"

#include <pthread.h>

#include <exception>
#include <utility>

#include "common/bus/process_loop.h"

namespace berth {

ThreadWorker::ThreadWorker(ProcessLoop& loop) : loop_(loop), thread_([this] { work(); }) {
  pthread_setname_np(thread_.native_handle(), "worker");
}

ThreadWorker::~ThreadWorker() {
  *alive_ = false;
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  given_.notify_one();
  thread_.join();
}

void ThreadWorker::give(Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (jobs_.empty()) begun_ = loop_.now();
    jobs_.push_back(std::make_shared<Job>(std::move(job)));
  }
  given_.notify_one();
}

std::size_t ThreadWorker::waiting() const {
  const std::lock_guard lock(mutex_);
  return jobs_.size();
}

std::optional<Worker::Overdue> ThreadWorker::overdue() const {
  const std::lock_guard lock(mutex_);
  if (jobs_.empty() || loop_.now() - begun_ <= jobs_.front()->budget) return std::nullopt;
  return Overdue{jobs_.front()->name, jobs_.front()->budget};
}

void ThreadWorker::work() {
  for (;;) {
    std::shared_ptr<Job> job;
    {
      std::unique_lock lock(mutex_);
      given_.wait(lock, [this] { return ends_ || !jobs_.empty(); });
      if (ends_) return;
      job = jobs_.front();
    }
    std::exception_ptr failure;
    try {
      job->run();
    } catch (...) {
      failure = std::current_exception();
    }
    {
      const std::lock_guard lock(mutex_);
      begun_ = loop_.now();
      jobs_.pop_front();
    }
    loop_.post([job = std::move(job), failure = std::move(failure), alive = alive_] {
      if (!*alive) return;
      if (failure) std::rethrow_exception(failure);
      job->done();
    });
  }
}

}  // namespace berth
