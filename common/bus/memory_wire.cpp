// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/memory_wire.h"

#include <algorithm>
#include <vector>

namespace berth {
namespace {

/// About what Linux gives a local stream.
constexpr std::size_t capacity = 208 << 10;

/// What one end has been sent and not read yet. Outlives its wire in the events under way.
struct Inbox {
  Loop& loop;
  Utime latency;
  std::vector<std::uint8_t> bytes;
  std::size_t read = 0;
  bool peer_gone = false;
  Wire::Readable readable;
  bool due = false;  // readable is

  std::size_t unread() const { return bytes.size() - read; }
};

void notify(const std::shared_ptr<Inbox>& inbox) {
  if (inbox->due || !inbox->readable || (inbox->unread() == 0 && !inbox->peer_gone)) return;
  inbox->due = true;
  inbox->loop.after(inbox->latency, [inbox] {
    inbox->due = false;
    if (!inbox->readable) return;
    const Wire::Readable readable = inbox->readable;  // which may end its own watch
    readable();
    notify(inbox);
  });
}

class MemoryWire final : public Wire {
 public:
  MemoryWire(std::shared_ptr<Inbox> own, std::shared_ptr<Inbox> peers)
      : own_(std::move(own)), peers_(std::move(peers)) {}
  ~MemoryWire() override {
    own_->readable = nullptr;
    own_->bytes.clear();
    own_->read = 0;
    // Whoever writes to an inbox without a reader learns it from his own.
    peers_->peer_gone = true;
    notify(peers_);
  }
  MemoryWire(const MemoryWire&) = delete;
  MemoryWire& operator=(const MemoryWire&) = delete;

  std::optional<std::size_t> read(std::span<std::uint8_t> into) override {
    const std::size_t size = std::min(into.size(), own_->unread());
    if (size == 0 && own_->peer_gone) return std::nullopt;
    std::copy_n(own_->bytes.begin() + static_cast<std::ptrdiff_t>(own_->read), size, into.begin());
    own_->read += size;
    if (own_->unread() == 0) {
      own_->bytes.clear();
      own_->read = 0;
    }
    return size;
  }

  std::optional<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    if (own_->peer_gone) return std::nullopt;
    const std::size_t size = std::min(bytes.size(), capacity - peers_->unread());
    peers_->bytes.insert(peers_->bytes.end(), bytes.begin(),
                         bytes.begin() + static_cast<std::ptrdiff_t>(size));
    notify(peers_);
    return size;
  }

  void watch(Readable readable) override {
    own_->readable = std::move(readable);
    notify(own_);
  }

  void unwatch() override { own_->readable = nullptr; }

 private:
  std::shared_ptr<Inbox> own_;
  std::shared_ptr<Inbox> peers_;
};

}  // namespace

std::pair<std::unique_ptr<Wire>, std::unique_ptr<Wire>> make_memory_wire(Loop& one, Loop& other,
                                                                         Utime latency) {
  const auto of_one = std::make_shared<Inbox>(Inbox{one, latency, {}, 0, false, {}, false});
  const auto of_other = std::make_shared<Inbox>(Inbox{other, latency, {}, 0, false, {}, false});
  return {std::make_unique<MemoryWire>(of_one, of_other),
          std::make_unique<MemoryWire>(of_other, of_one)};
}

}  // namespace berth
