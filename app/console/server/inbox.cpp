// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/inbox.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <system_error>

namespace berth::console {
namespace {

constexpr std::size_t max_waiting = 1000;
constexpr std::chrono::seconds between_refusals{1};

}  // namespace

Inbox::Inbox() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

Inbox::~Inbox() { close(fd_); }

void Inbox::keep(Incoming incoming) {
  waiting_.push_back(std::move(incoming));
  eventfd_write(fd_, 1);
}

bool Inbox::put(Incoming incoming) {
  const std::lock_guard lock(mutex_);
  // A viewer that left is always reported: its commands may have to end.
  const bool must = incoming.kind != Incoming::Kind::command;
  if (!must && waiting_.size() >= max_waiting) return false;
  keep(std::move(incoming));
  return true;
}

void Inbox::refuse(const std::string& code, const std::string& text) {
  const std::lock_guard lock(mutex_);
  ++refused_;
  Kind& kind = refusals_[code];
  const auto now = Clock::now();
  if (kind.reported != Clock::time_point{} && now < kind.reported + between_refusals) {
    ++kind.more;
    kind.last = text;
    return;
  }
  kind.reported = now;
  keep({Incoming::Kind::refused, "", {}, code, text});
}

void Inbox::report_more() {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  for (auto& [code, kind] : refusals_) {
    if (kind.more == 0 || now < kind.reported + between_refusals) continue;
    keep({Incoming::Kind::refused,
          "",
          {},
          code,
          std::to_string(kind.more) + " more, the last: " + kind.last});
    kind.reported = now;
    kind.more = 0;
  }
}

std::vector<Incoming> Inbox::take() {
  const std::lock_guard lock(mutex_);
  eventfd_t count = 0;
  eventfd_read(fd_, &count);
  return std::exchange(waiting_, {});
}

std::int64_t Inbox::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

}  // namespace berth::console
