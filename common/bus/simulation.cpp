// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/simulation.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <system_error>

#include "common/core/error.h"
#include "common/core/random.h"

namespace berth {

struct Simulation::Impl {
  struct Event {
    SimulatedLoop* loop;  // null: of the simulation itself
    Loop::TimerId timer;  // 0: cannot be cancelled
    Utime period;         // 0: once
    Loop::Task task;
  };
  using Key = std::pair<Utime, std::uint64_t>;  // equal times run in the order they were asked for

  struct Watch {
    SimulatedLoop* loop;
    int fd;
    std::shared_ptr<Loop::Task> readable;
    bool pending = false;
  };

  struct Subscription {
    SimulatedBus* bus;
    std::function<void(Bytes)> handler;
  };

  class PairedWires final : public Wires {
   public:
    explicit PairedWires(Simulation& simulation) : simulation_(simulation) {}

    void dial(const std::string& address, Connected connected) override {
      Impl& impl = *simulation_.impl_;
      impl.add(
          simulation_.now_ + impl.options.wire_latency, nullptr, 0,
          [this, address, connected = std::move(connected)] {
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

  void add(Utime when, SimulatedLoop* loop, Utime period, Loop::Task task,
           Loop::TimerId timer = 0) {
    const Key key{when, ++order};
    events.emplace(key, Event{loop, timer, period, std::move(task)});
    if (timer != 0) timers[timer] = key;
  }

  /// Bytes may have been written by the event that just ran.
  void notice_readable(Utime now) {
    if (watches.empty()) return;
    ready.resize(watches.size());
    const int count = ::epoll_wait(readiness, ready.data(), static_cast<int>(ready.size()), 0);
    if (count <= 0) return;
    // The kernel's order is that of its own affairs.
    noticed.clear();
    for (int i = 0; i < count; ++i) {
      const auto watch = find(ready[static_cast<std::size_t>(i)].data.fd);
      if (watch != watches.end() && !watch->pending) noticed.push_back(watch - watches.begin());
    }
    std::sort(noticed.begin(), noticed.end());
    for (const std::ptrdiff_t i : noticed) {
      Watch& watch = watches[static_cast<std::size_t>(i)];
      watch.pending = true;
      add(now + options.wire_latency, watch.loop, 0,
          [this, fd = watch.fd, readable = std::weak_ptr<Loop::Task>(watch.readable)] {
            const auto task = readable.lock();
            if (!task) return;  // no longer watched
            find(fd)->pending = false;
            (*task)();
          });
    }
  }

  std::vector<Watch>::iterator find(int fd) {
    return std::find_if(watches.begin(), watches.end(), [&](const Watch& w) { return w.fd == fd; });
  }

  Options options;
  PairedWires wires;
  std::map<Key, Event> events;
  std::unordered_map<Loop::TimerId, Key> timers;
  std::uint64_t order = 0;
  Loop::TimerId last_timer = 0;
  std::vector<Watch> watches;  // in the order of registration: descriptors' numbers mean nothing
  int readiness;               // of epoll: it costs what is ready, not what is watched
  std::vector<epoll_event> ready;
  std::vector<std::ptrdiff_t> noticed;
  std::unordered_map<std::string, std::vector<Subscription>> subscriptions;
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
  while (!impl_->events.empty() && impl_->events.begin()->first.first <= limit) {
    auto node = impl_->events.extract(impl_->events.begin());
    Impl::Event& event = node.mapped();
    now_ = std::max(now_, node.key().first);
    if (event.timer != 0) {
      if (event.period > 0) {
        impl_->add(now_ + event.period, event.loop, event.period, event.task, event.timer);
      } else {
        impl_->timers.erase(event.timer);
      }
    }
    if (event.loop == nullptr || !event.loop->stopped_) {
      event.task();
    } else if (event.period == 0) {
      event.loop->waiting_.push_back(std::move(event.task));
    }
    ++events_run_;
    // Once before the clock moves on: what is written now is seen a latency from now.
    const bool moves_on = impl_->events.empty() || impl_->events.begin()->first.first > now_;
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
  for (auto& [channel, subscriptions] : impl_->subscriptions) {
    std::erase_if(subscriptions, [&](const auto& s) { return s.bus == &bus; });
  }
  loop.waiting_.clear();
  bus.waiting_.clear();
}

void Simulation::set_bus_loss(double share) { impl_->options.bus_loss = share; }

void Simulation::record(Recorder recorder) { impl_->recorders.push_back(std::move(recorder)); }

Utime SimulatedLoop::now() const { return simulation_.now_; }

Loop::TimerId SimulatedLoop::at(Utime when, Task task) {
  const TimerId id = ++simulation_.impl_->last_timer;
  simulation_.impl_->add(std::max(when, now()), this, 0, std::move(task), id);
  return id;
}

Loop::TimerId SimulatedLoop::every(Utime period, Task task) {
  const TimerId id = ++simulation_.impl_->last_timer;
  simulation_.impl_->add(now() + period, this, period, std::move(task), id);
  return id;
}

void SimulatedLoop::cancel(TimerId timer) {
  auto& timers = simulation_.impl_->timers;
  const auto found = timers.find(timer);
  if (found == timers.end()) return;
  simulation_.impl_->events.erase(found->second);
  timers.erase(found);
}

void SimulatedLoop::watch(int fd, Task readable) {
  unwatch(fd);
  simulation_.impl_->watches.push_back({this, fd, std::make_shared<Task>(std::move(readable))});
  epoll_event interest{};
  interest.events = EPOLLIN;
  interest.data.fd = fd;
  if (epoll_ctl(simulation_.impl_->readiness, EPOLL_CTL_ADD, fd, &interest) != 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
}

void SimulatedLoop::unwatch(int fd) {
  auto& watches = simulation_.impl_->watches;
  const auto found = simulation_.impl_->find(fd);
  if (found == watches.end()) return;
  watches.erase(found);
  // A descriptor that was closed has left by itself.
  epoll_ctl(simulation_.impl_->readiness, EPOLL_CTL_DEL, fd, nullptr);
}

void SimulatedBus::send(const std::string& channel, Bytes bytes) {
  Simulation::Impl& impl = *simulation_.impl_;
  impl.add(simulation_.now_ + compute_delay_ + impl.options.bus_latency, nullptr, 0,
           [&impl, &simulation = simulation_, channel,
            copy = std::vector<std::uint8_t>(bytes.begin(), bytes.end())] {
             for (const auto& recorder : impl.recorders) recorder(simulation.now(), channel, copy);
             const auto found = impl.subscriptions.find(channel);
             if (found == impl.subscriptions.end()) return;
             for (const auto& subscription : found->second) {
               const double loss = impl.options.bus_loss;
               if (loss > 0 && impl.loss_random.uniform() < loss) continue;
               if (subscription.bus->stopped_) {
                 subscription.bus->waiting_.push_back(
                     [handler = subscription.handler, copy] { handler(copy); });
                 continue;
               }
               ++subscription.bus->counters_.received;
               subscription.handler(copy);
             }
           });
}

void SimulatedBus::receive(const std::string& channel, Queue /*runs inline*/, RawHandler handler) {
  simulation_.impl_->subscriptions[channel].push_back({this, std::move(handler)});
}

}  // namespace berth
