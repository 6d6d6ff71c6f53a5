// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/simulation.h"

#include <algorithm>
#include <deque>
#include <unordered_map>
#include <utility>

#include "common/bus/worker.h"
#include "common/core/random.h"

namespace berth {

void EventQueue::push(Utime when, std::uint32_t slot) {
  heap_.push_back({when, ++order_, slot, slots_[slot].uses});
  std::push_heap(heap_.begin(), heap_.end(), Later());
}

void EventQueue::pop() {
  std::pop_heap(heap_.begin(), heap_.end(), Later());
  heap_.pop_back();
}

void EventQueue::release(std::uint32_t slot) {
  slots_[slot].event = {};
  ++slots_[slot].uses;
  free_.push_back(slot);
}

Loop::TimerId EventQueue::add(Utime when, Event event) {
  if (free_.empty()) {
    free_.push_back(static_cast<std::uint32_t>(slots_.size()));
    slots_.emplace_back();
  }
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  slots_[slot].event = std::move(event);
  push(when, slot);
  return Loop::TimerId{slots_[slot].uses} << 32 | slot;
}

void EventQueue::cancel(Loop::TimerId timer) {
  const auto slot = static_cast<std::uint32_t>(timer);
  if (slot < slots_.size() && slots_[slot].uses == timer >> 32) release(slot);
}

std::optional<Utime> EventQueue::next() {
  while (!heap_.empty() && slots_[heap_.front().slot].uses != heap_.front().uses) pop();
  if (heap_.empty()) return std::nullopt;
  return heap_.front().when;
}

EventQueue::Event EventQueue::take() {
  const Entry entry = heap_.front();
  pop();
  Event& event = slots_[entry.slot].event;
  if (event.period > 0) {
    push(entry.when + event.period, entry.slot);
    return event;
  }
  Event once = std::move(event);
  release(entry.slot);
  return once;
}

struct Simulation::Impl {
  struct Subscription {
    SimulatedBus* bus;
    std::function<void(Bytes)> handler;
  };

  struct Channel {
    std::string name;
    std::vector<Subscription> subscriptions;
  };

  /// A message under way. Used again once it has arrived.
  struct Packet {
    Channel* channel = nullptr;
    std::vector<std::uint8_t> bytes;
  };

  explicit Impl(Options given) : options(given), loss_random(given.loss_seed, "packet loss") {}

  Loop::TimerId add(Utime when, SimulatedLoop* loop, Utime period, Loop::Task task) {
    return events.add(when, {loop, period, std::move(task)});
  }

  Channel& channel(const std::string& name) {
    Channel& channel = channels[name];
    if (channel.name.empty()) channel.name = name;
    return channel;
  }

  Packet& packet(const std::string& name, Bytes bytes) {
    if (spare_packets.empty()) spare_packets.push_back(&packets.emplace_back());
    Packet& packet = *spare_packets.back();
    spare_packets.pop_back();
    packet.channel = &channel(name);
    packet.bytes.assign(bytes.begin(), bytes.end());
    return packet;
  }

  void deliver(Packet& packet, Utime now) {
    const std::vector<std::uint8_t>& bytes = packet.bytes;
    for (const auto& recorder : recorders) recorder(now, packet.channel->name, bytes);
    for (const auto& subscription : packet.channel->subscriptions) {
      const double loss = options.bus_loss;
      if (loss > 0 && loss_random.uniform() < loss) continue;
      SimulatedBus& bus = *subscription.bus;
      if (bus.stopped_) {
        bus.waiting_.push_back([handler = subscription.handler, copy = bytes] { handler(copy); });
        continue;
      }
      ++bus.counters_.received;
      subscription.handler(bytes);
    }
    spare_packets.push_back(&packet);
  }

  Options options;
  EventQueue events;
  std::unordered_map<std::string, Channel> channels;
  std::deque<Packet> packets;
  std::vector<Packet*> spare_packets;
  std::vector<Recorder> recorders;
  Random loss_random;
  std::vector<std::unique_ptr<SimulatedLoop>> loops;
  std::vector<std::unique_ptr<SimulatedBus>> buses;
};

Simulation::Simulation(Options options)
    : impl_(std::make_unique<Impl>(options)), now_(options.start) {}
Simulation::~Simulation() = default;

void Simulation::run_until(Utime end) {
  run_until([] { return false; }, end);
}

bool Simulation::run_until(const std::function<bool()>& done, Utime limit) {
  for (auto next = impl_->events.next(); next && *next <= limit; next = impl_->events.next()) {
    now_ = std::max(now_, *next);
    EventQueue::Event event = impl_->events.take();
    if (event.loop == nullptr || !event.loop->stopped_) {
      event.task();
    } else if (event.period == 0) {
      event.loop->waiting_.push_back(std::move(event.task));
    }
    if (done()) return true;
  }
  now_ = std::max(now_, limit);
  return done();
}

SimulatedLoop& Simulation::make_loop() {
  impl_->loops.emplace_back(new SimulatedLoop(*this));
  return *impl_->loops.back();
}

SimulatedBus& Simulation::make_bus(Utime compute_delay) {
  impl_->buses.emplace_back(new SimulatedBus(*this, compute_delay));
  return *impl_->buses.back();
}

void Simulation::stop(SimulatedLoop& loop, SimulatedBus& bus) {
  loop.stopped_ = bus.stopped_ = true;
}

void Simulation::go_on(SimulatedLoop& loop, SimulatedBus& bus) {
  loop.stopped_ = bus.stopped_ = false;
  for (auto* waiting : {&bus.waiting_, &loop.waiting_}) {
    for (auto& task : *waiting) impl_->add(now_, &loop, 0, std::move(task));
    waiting->clear();
  }
}

void Simulation::stop_work(SimulatedLoop& loop) { loop.work_stopped_ = true; }

void Simulation::kill(SimulatedLoop& loop, SimulatedBus& bus) {
  stop(loop, bus);
  for (auto& [name, channel] : impl_->channels) {
    std::erase_if(channel.subscriptions, [&](const auto& s) { return s.bus == &bus; });
  }
  loop.waiting_.clear();
  bus.waiting_.clear();
}

void Simulation::set_bus_loss(double share) { impl_->options.bus_loss = share; }

Utime Simulation::wire_latency() const { return impl_->options.wire_latency; }

void Simulation::record(Recorder recorder) { impl_->recorders.push_back(std::move(recorder)); }

class SimulatedLoop::InlineWorker final : public Worker {
 public:
  explicit InlineWorker(SimulatedLoop& loop) : loop_(loop) { loop_.workers_.push_back(this); }
  ~InlineWorker() override { std::erase(loop_.workers_, this); }

  void give(Job job) override {
    if (loop_.work_stopped_ || !jobs_.empty()) {
      if (jobs_.empty()) begun_ = loop_.now();
      return jobs_.push_back(std::move(job));
    }
    job.run();
    job.done();
  }
  std::size_t waiting() const override { return jobs_.size(); }
  std::optional<Overdue> overdue() const override {
    if (jobs_.empty() || loop_.now() - begun_ <= jobs_.front().budget) return std::nullopt;
    return Overdue{jobs_.front().name, jobs_.front().budget};
  }
  void go_on() {
    while (!jobs_.empty()) {
      const Job job = std::move(jobs_.front());
      jobs_.pop_front();
      job.run();
      job.done();
    }
  }

 private:
  SimulatedLoop& loop_;
  std::deque<Job> jobs_;
  Utime begun_ = 0;
};

void Simulation::go_on_with_work(SimulatedLoop& loop) {
  loop.work_stopped_ = false;
  loop.after(0, [&loop] {
    for (SimulatedLoop::InlineWorker* worker : loop.workers_) worker->go_on();
  });
}

std::unique_ptr<Worker> SimulatedLoop::make_worker() {
  return std::make_unique<InlineWorker>(*this);
}

Utime SimulatedLoop::now() const { return simulation_.now_; }

Loop::TimerId SimulatedLoop::at(Utime when, Task task) {
  return simulation_.impl_->add(std::max(when, now()), this, 0, std::move(task));
}

Loop::TimerId SimulatedLoop::every(Utime period, Task task) {
  return simulation_.impl_->add(now() + period, this, period, std::move(task));
}

void SimulatedLoop::cancel(TimerId timer) { simulation_.impl_->events.cancel(timer); }

void SimulatedBus::send(const std::string& channel, Bytes bytes) {
  Simulation::Impl& impl = *simulation_.impl_;
  impl.add(simulation_.now_ + compute_delay_ + impl.options.bus_latency, nullptr, 0,
           [this, packet = &impl.packet(channel, bytes)] {
             simulation_.impl_->deliver(*packet, simulation_.now_);
           });
}

void SimulatedBus::receive(const std::string& channel, Queue /*runs inline*/, RawHandler handler) {
  simulation_.impl_->channel(channel).subscriptions.push_back({this, std::move(handler)});
}

}  // namespace berth
