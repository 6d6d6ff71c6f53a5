// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/simulation.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <map>
#include <system_error>
#include <unordered_map>

#include "common/bus/event_queue.h"
#include "common/core/error.h"
#include "common/core/random.h"

namespace berth {

struct Simulation::Impl {
  struct Watch {
    SimulatedLoop* loop;
    int fd;
    std::uint64_t id;  // descriptors' numbers are used again
    std::shared_ptr<Loop::Task> readable;
    bool pending = false;
  };

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

  class PairedWires final : public Wires {
   public:
    explicit PairedWires(Simulation& simulation) : simulation_(simulation) {}

    void dial(const std::string& address, Connected connected) override {
      Impl& impl = *simulation_.impl_;
      impl.add(
          simulation_.now_ + impl.options.wire_latency, nullptr, 0,
          [this, &impl, address, connected = std::move(connected)] {
            impl.touched = true;
            const auto listener = listeners_.find(address);
            if (listener == listeners_.end()) return connected(-1);
            int ends[2];
            if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0) {
              throw std::system_error(errno, std::generic_category(), "socketpair");
            }
            listener->second(ends[0]);
            connected(ends[1]);
          });
    }

    void listen(const std::string& address, Connected accepted) override {
      if (!listeners_.emplace(address, std::move(accepted)).second) {
        throw InputError("address " + address + " is served twice");
      }
    }

   private:
    Simulation& simulation_;
    std::map<std::string, Connected> listeners_;
  };

  Impl(Simulation& simulation, Options given)
      : options(given),
        wires(simulation),
        readiness(epoll_create1(EPOLL_CLOEXEC)),
        loss_random(given.loss_seed, "packet loss") {
    if (readiness < 0) throw std::system_error(errno, std::generic_category(), "epoll_create1");
  }
  ~Impl() { ::close(readiness); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

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
      if (bus.loop_ == nullptr || bus.loop_->watched_ > 0) touched = true;
      ++bus.counters_.received;
      subscription.handler(bytes);
    }
    spare_packets.push_back(&packet);
  }

  /// Bytes may have been written since it was last looked.
  void notice_readable(Utime now) {
    if (!touched) return;
    touched = false;
    if (watches.empty()) return;
    ready.resize(watches.size());
    const int count = ::epoll_wait(readiness, ready.data(), static_cast<int>(ready.size()), 0);
    if (count <= 0) return;
    // The kernel's order is that of its own affairs.
    noticed.clear();
    for (int i = 0; i < count; ++i) {
      const auto watch = with_id(ready[static_cast<std::size_t>(i)].data.u64);
      if (watch != watches.end() && !watch->pending) noticed.push_back(watch - watches.begin());
    }
    std::sort(noticed.begin(), noticed.end());
    for (const std::ptrdiff_t i : noticed) {
      Watch& watch = watches[static_cast<std::size_t>(i)];
      watch.pending = true;
      add(now + options.wire_latency, watch.loop, 0, [this, id = watch.id] {
        const auto found = with_id(id);
        if (found == watches.end()) return;  // no longer watched
        found->pending = false;
        const auto readable = found->readable;  // which may end its own watch
        (*readable)();
      });
    }
  }

  std::vector<Watch>::iterator of_descriptor(int fd) {
    return std::find_if(watches.begin(), watches.end(), [&](const Watch& w) { return w.fd == fd; });
  }

  std::vector<Watch>::iterator with_id(std::uint64_t id) {
    return std::find_if(watches.begin(), watches.end(), [&](const Watch& w) { return w.id == id; });
  }

  Options options;
  PairedWires wires;
  EventQueue events;
  std::vector<Watch> watches;  // in the order of registration: descriptors' numbers mean nothing
  std::uint64_t last_watch = 0;
  int readiness;        // of epoll: it costs what is ready, not what is watched
  bool touched = true;  // by one who has wires: only such can have written
  std::vector<epoll_event> ready;
  std::vector<std::ptrdiff_t> noticed;
  std::unordered_map<std::string, Channel> channels;
  std::deque<Packet> packets;
  std::vector<Packet*> spare_packets;
  std::vector<Recorder> recorders;
  Random loss_random;
  std::vector<std::unique_ptr<SimulatedLoop>> loops;
  std::vector<std::unique_ptr<SimulatedBus>> buses;
};

Simulation::Simulation(Options options)
    : impl_(std::make_unique<Impl>(*this, options)), now_(options.start) {}
Simulation::~Simulation() = default;

void Simulation::run_until(Utime end) {
  run_until([] { return false; }, end);
}

bool Simulation::run_until(const std::function<bool()>& done, Utime limit) {
  impl_->touched = true;  // by whoever acts between two runs
  for (auto next = impl_->events.next(); next && *next <= limit; next = impl_->events.next()) {
    now_ = std::max(now_, *next);
    EventQueue::Event event = impl_->events.take();
    if (event.loop == nullptr || !event.loop->stopped_) {
      if (event.loop != nullptr && event.loop->watched_ > 0) impl_->touched = true;
      event.task();
    } else if (event.period == 0) {
      event.loop->waiting_.push_back(std::move(event.task));
    }
    ++events_run_;
    // Once before the clock moves on: what is written now is seen a latency from now.
    const auto after = impl_->events.next();
    const bool moves_on = !after || *after > now_;
    const bool is_done = done();
    if (moves_on || is_done) impl_->notice_readable(now_);
    if (is_done) return true;
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

SimulatedBus& Simulation::make_bus(Utime compute_delay, const SimulatedLoop& loop) {
  SimulatedBus& bus = make_bus(compute_delay);
  bus.loop_ = &loop;
  return bus;
}

Wires& Simulation::wires() { return impl_->wires; }

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

void Simulation::kill(SimulatedLoop& loop, SimulatedBus& bus) {
  stop(loop, bus);
  for (auto& [name, channel] : impl_->channels) {
    std::erase_if(channel.subscriptions, [&](const auto& s) { return s.bus == &bus; });
  }
  loop.waiting_.clear();
  bus.waiting_.clear();
}

void Simulation::set_bus_loss(double share) { impl_->options.bus_loss = share; }

void Simulation::record(Recorder recorder) { impl_->recorders.push_back(std::move(recorder)); }

Utime SimulatedLoop::now() const { return simulation_.now_; }

Loop::TimerId SimulatedLoop::at(Utime when, Task task) {
  return simulation_.impl_->add(std::max(when, now()), this, 0, std::move(task));
}

Loop::TimerId SimulatedLoop::every(Utime period, Task task) {
  return simulation_.impl_->add(now() + period, this, period, std::move(task));
}

void SimulatedLoop::cancel(TimerId timer) { simulation_.impl_->events.cancel(timer); }

void SimulatedLoop::watch(int fd, Task readable) {
  unwatch(fd);
  ++watched_;
  simulation_.impl_->touched = true;
  const std::uint64_t id = ++simulation_.impl_->last_watch;
  simulation_.impl_->watches.push_back({this, fd, id, std::make_shared<Task>(std::move(readable))});
  epoll_event interest{};
  interest.events = EPOLLIN;
  interest.data.u64 = id;
  if (epoll_ctl(simulation_.impl_->readiness, EPOLL_CTL_ADD, fd, &interest) != 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
}

void SimulatedLoop::unwatch(int fd) {
  auto& watches = simulation_.impl_->watches;
  const auto found = simulation_.impl_->of_descriptor(fd);
  if (found == watches.end()) return;
  --found->loop->watched_;
  simulation_.impl_->touched = true;
  watches.erase(found);
  // A descriptor that was closed has left by itself.
  epoll_ctl(simulation_.impl_->readiness, EPOLL_CTL_DEL, fd, nullptr);
}

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
