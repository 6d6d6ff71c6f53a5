// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/lcm_bus.h"

#include <atomic>
#include <deque>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <mutex>
#include <thread>

#include "common/core/error.h"

namespace berth {

std::string bus_url(const std::string& given) {
  std::string url = given;
  if (url.empty()) {
    const char* environment = std::getenv("LCM_DEFAULT_URL");
    url = environment != nullptr && *environment != '\0' ? environment
                                                         : "udpm://239.255.76.67:7667?ttl=0";
  }
  if (url.rfind("udpm://", 0) != 0) {
    throw InputError("LCM URL '" + url + "': expected udpm://GROUP:PORT?ttl=0");
  }
  // LCM accepts an unknown option, with a line on stderr.
  const auto question = url.find('?');
  for (std::size_t at = question; at != std::string::npos && at + 1 < url.size();) {
    const auto end = url.find('&', at + 1);
    const std::string option = url.substr(at + 1, end == std::string::npos ? end : end - at - 1);
    const std::string name = option.substr(0, option.find('='));
    if (name != "ttl" && name != "recv_buf_size" && name != "transmit_only") {
      throw InputError("LCM URL '" + url + "': option '" + name +
                       "' is not known; expected ttl, recv_buf_size or transmit_only");
    }
    at = end;
  }
  if (url.find("recv_buf_size") == std::string::npos) {
    // As much as the kernel grants, up to 4 MB: LCM warns when more is requested.
    std::ifstream limit("/proc/sys/net/core/rmem_max");
    long bytes = 0;
    limit >> bytes;
    bytes = std::min(bytes, 4194304L);
    if (bytes > 0) {
      url += (question == std::string::npos ? "?" : "&");
      url += "recv_buf_size=" + std::to_string(bytes);
    }
  }
  return url;
}

struct LcmBus::Impl {
  struct Subscription {
    Impl* impl;
    Queue queue;
    LcmBus::AnyHandler handler;
    std::size_t waiting = 0;            // entries in the inbox
    std::vector<std::uint8_t> mailbox;  // of a latest-value subscription

    void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
      impl->enqueue(*this, channel, buffer);
    }
  };

  struct Entry {
    Subscription* subscription;
    std::string channel;
    std::vector<std::uint8_t> bytes;  // empty for a mailbox
  };

  Impl(const std::string& given, ProcessLoop& on) : url(bus_url(given)), loop(on), lcm(url) {
    if (!lcm.good()) {
      throw InputError("LCM cannot use " + url +
                       ": is there a multicast route? 'berth doctor' shows how to repair it");
    }
  }

  /// In the receive thread: only copies the bytes.
  void enqueue(Subscription& subscription, const std::string& channel,
               const lcm::ReceiveBuffer* buffer) {
    const auto* data = static_cast<const std::uint8_t*>(buffer->data);
    const auto* end = data + buffer->data_size;
    const std::lock_guard lock(mutex);
    ++received;
    if (subscription.queue.capacity == 0) {
      subscription.mailbox.assign(data, end);
      if (subscription.waiting > 0) {
        ++superseded;
        return;
      }
      inbox.push_back({&subscription, channel, {}});
    } else {
      if (subscription.waiting >= subscription.queue.capacity) {
        ++overflowed;
        return;
      }
      inbox.push_back({&subscription, channel, {data, end}});
    }
    ++subscription.waiting;
    if (!drain_pending) {
      drain_pending = true;
      loop.post([this] { drain(); });
    }
  }

  /// On the loop. One message per turn of the loop: due timers run between two messages, and a
  /// handler receives the newest state.
  void drain() {
    Entry entry{};
    {
      const std::lock_guard lock(mutex);
      entry = std::move(inbox.front());
      inbox.pop_front();
      --entry.subscription->waiting;
      if (entry.subscription->queue.capacity == 0) entry.bytes = entry.subscription->mailbox;
      drain_pending = !inbox.empty();
      if (drain_pending) loop.post([this] { drain(); });
    }
    entry.subscription->handler(entry.channel, entry.bytes);
  }

  std::string url;
  ProcessLoop& loop;
  lcm::LCM lcm;
  std::deque<Subscription> subscriptions;  // stable addresses
  std::mutex mutex;
  std::deque<Entry> inbox;
  bool drain_pending = false;
  std::int64_t received = 0;
  std::int64_t overflowed = 0;
  std::int64_t superseded = 0;
  std::atomic<bool> stopping{false};
  std::thread receiver;
};

LcmBus::LcmBus(const std::string& url, ProcessLoop& loop)
    : impl_(std::make_unique<Impl>(url, loop)) {}

LcmBus::~LcmBus() {
  impl_->stopping = true;
  if (impl_->receiver.joinable()) impl_->receiver.join();
}

void LcmBus::start() {
  impl_->receiver = std::thread([impl = impl_.get()] {
    while (!impl->stopping) impl->lcm.handleTimeout(50);
  });
}

void LcmBus::send(const std::string& channel, Bytes bytes) {
  if (impl_->lcm.publish(channel, bytes.data(), static_cast<unsigned int>(bytes.size())) != 0) {
    ++counters_.unsent;
  }
}

void LcmBus::receive(const std::string& channel, Queue queue, RawHandler handler) {
  subscribe_pattern(
      channel, queue,
      [handler = std::move(handler)](const std::string&, Bytes bytes) { handler(bytes); });
}

void LcmBus::subscribe_all(Queue queue, AnyHandler handler) {
  subscribe_pattern(".*", queue, std::move(handler));
}

void LcmBus::subscribe_pattern(const std::string& pattern, Queue queue, AnyHandler handler) {
  auto& subscription = impl_->subscriptions.emplace_back(
      Impl::Subscription{impl_.get(), queue, std::move(handler), 0, {}});
  impl_->lcm.subscribe(pattern, &Impl::Subscription::on_message, &subscription)
      ->setQueueCapacity(1000);
}

BusCounters LcmBus::counters() const {
  BusCounters counters = counters_;
  const std::lock_guard lock(impl_->mutex);
  counters.received = impl_->received;
  counters.overflowed = impl_->overflowed;
  counters.superseded = impl_->superseded;
  return counters;
}

}  // namespace berth
