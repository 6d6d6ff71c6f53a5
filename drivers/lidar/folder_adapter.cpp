// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/folder_adapter.h"

#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <regex>
#include <system_error>

#include "common/core/error.h"
#include "common/core/text.h"
#include "drivers/lidar/limits.h"
#include "drivers/lidar/recording.h"

namespace berth::lidar {
namespace {

constexpr Utime again = 500 * millisecond;  // looking for a folder that is gone
constexpr Utime message_period = 2500;      // 400 a second, as packet_size has it
constexpr Utime since_2000 = 946684800LL * second;
constexpr Utime reading_budget = 60 * second;

Utime read_clock(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return time.tv_sec * second + time.tv_nsec / 1000;
}

Utime system_now() { return read_clock(CLOCK_REALTIME); }

/// The clock of the kernel's file stamps: that of its last tick, which may lag on an idle machine.
Utime file_system_now() { return read_clock(CLOCK_REALTIME_COARSE); }

/// us since 1970.
std::optional<Utime> time_in(const std::string& name) {
  static const std::regex pattern(R"((\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)(\.\d{1,6})?Z)");
  std::smatch found;
  if (!std::regex_search(name, found, pattern)) return std::nullopt;
  const auto number = [&](std::size_t group) { return std::stoi(found[group].str()); };
  std::tm utc{};
  utc.tm_year = number(1) - 1900;
  utc.tm_mon = number(2) - 1;
  utc.tm_mday = number(3);
  utc.tm_hour = number(4);
  utc.tm_min = number(5);
  utc.tm_sec = number(6);
  const std::tm given = utc;
  const std::time_t s = timegm(&utc);
  if (utc.tm_mon != given.tm_mon || utc.tm_mday != given.tm_mday || utc.tm_hour != given.tm_hour ||
      utc.tm_min != given.tm_min) {
    return std::nullopt;  // no such day or hour
  }
  const double fraction = found[7].matched ? std::stod("0" + found[7].str()) : 0;
  return static_cast<Utime>(s) * second + utime_from_seconds(fraction);
}

}  // namespace

StatedTime state_time(RecordedScan& scan, Utime changed) {
  const Utime first = scan.beams.front().utime;
  if (scan.timed && first >= since_2000) return {first, "the times of its beams"};
  const auto named = time_in(scan.name);
  const Utime shift = named ? *named - first : changed - scan.beams.back().utime;
  for (RecordedBeam& beam : scan.beams) beam.utime += shift;
  return {first + shift, named ? "its name" : "its last change"};
}

FolderAdapter::FolderAdapter(std::filesystem::path folder, const clouds::CloudOptions& options,
                             const LidarProfile& profile, ProcessLoop& loop)
    : folder_(std::move(folder)),
      name_(folder_.string()),
      options_(options),
      rate_hz_(profile.rate_hz),
      beams_per_message_(static_cast<std::size_t>(packet_size(profile, 50))),
      identity_(identity_of(profile, "(folder)")),
      loop_(loop),
      worker_(loop.make_worker()),
      inotify_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
  if (inotify_ < 0) throw std::system_error(errno, std::generic_category(), "inotify");
  std::error_code error;
  if (!std::filesystem::is_directory(folder_, error)) {
    close(inotify_);
    throw InputError(name_ + ": no such folder, expected where the LIDAR exports its scans");
  }
}

FolderAdapter::~FolderAdapter() {
  worker_.reset();
  loop_.cancel(timer_);
  loop_.cancel(watch_timer_);
  loop_.unwatch(inotify_);
  close(inotify_);
}

void FolderAdapter::start(Events events) {
  events_ = std::move(events);
  loop_.watch(inotify_, [this] { read_events(); });
  watch_timer_ = loop_.after(0, [this] { watch(); });
}

void FolderAdapter::watch() {
  watched_ =
      inotify_add_watch(inotify_, name_.c_str(),
                        IN_CLOSE_WRITE | IN_MOVED_TO | IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR);
  if (watched_ < 0) {
    watch_timer_ = loop_.after(again, [this] { watch(); });
    const std::string reason = name_ + ": " + std::generic_category().message(errno);
    if (reason == reason_) return;
    reason_ = reason;
    return events_.lost(reason);
  }
  reason_.clear();
  events_.ready();
}

ClockLine FolderAdapter::clock() const {
  const Utime now = loop_.now();
  return {now, system_now() - now, 0, 0};
}

void FolderAdapter::read_events() {
  alignas(inotify_event) std::array<char, 16384> bytes;
  for (ssize_t size = 0; (size = ::read(inotify_, bytes.data(), bytes.size())) > 0;) {
    for (const char* at = bytes.data(); at < bytes.data() + size;) {
      inotify_event event{};
      std::memcpy(&event, at, sizeof event);
      const std::string file = event.len > 0 ? at + sizeof event : "";
      at += sizeof event + event.len;
      if ((event.mask & IN_Q_OVERFLOW) != 0) {
        events_.trouble(name_ + ": more files came at once than the system could report");
      } else if (event.wd != watched_) {
        continue;  // of a folder that is gone
      } else if ((event.mask & (IN_DELETE_SELF | IN_MOVE_SELF | IN_UNMOUNT)) != 0) {
        inotify_rm_watch(inotify_, watched_);
        drop(name_ + ": the folder is gone");
      } else if ((event.mask & IN_ISDIR) == 0 && !file.empty() && file[0] != '.') {
        take_file(file);
      }
    }
  }
}

void FolderAdapter::take_file(const std::string& file) {
  if (!clouds::is_cloud(folder_ / file)) return;
  auto taken = std::make_shared<File>();
  taken->path = folder_ / file;
  worker_->give({"reading " + file, reading_budget, [this, taken] { read(*taken); },
                 [this, taken] { use(*taken); }});
}

/// On the worker.
void FolderAdapter::read(File& file) const {
  try {
    struct stat status {};
    if (stat(file.path.c_str(), &status) != 0) {
      file.fault = file.path.string() + ": " + std::generic_category().message(errno);
      return;
    }
    file.version = {status.st_ino, status.st_mtim.tv_sec * 1000000000LL + status.st_mtim.tv_nsec,
                    status.st_size};
    file.scan = read_scan(file.path, rate_hz_, options_);
    if (file.scan.beams.empty()) file.fault = file.path.string() + ": holds no beam";
  } catch (const InputError& e) {
    file.fault = e.what();
  }
}

void FolderAdapter::use(File& file) {
  const std::string path = file.path.string();
  if (std::exchange(seen_[path], file.version) == file.version) return;
  if (!file.fault.empty()) return events_.trouble(file.fault + "; not used");
  const StatedTime time = state_time(file.scan, file.version.changed_ns / 1000);
  if (!ready() || !pending_ || pending_->scan) {
    return events_.trouble(path + ": came while no scan was waited for; not used");
  }
  if (time.first < pending_->ordered - clock_tolerance) {
    return events_.trouble(path + ": by " + time.source + " its scan began " +
                           fixed(seconds(pending_->ordered - time.first), 3) +
                           " s before it was ordered; not used");
  }
  pending_->scan = std::move(file.scan);
  send_beams();
}

void FolderAdapter::order(const ScanOrder& order) {
  pending_ = Pending{order.scan_id, file_system_now(), {}, 0};
  ScanAnswer answer;
  answer.scan_id = order.scan_id;
  answer.accepted = true;  // the file has the number of beams
  // From the loop, as an answer over a wire would come.
  timer_ = loop_.after(0, [this, answer] { events_.message(answer); });
}

void FolderAdapter::send_beams() {
  const std::vector<RecordedBeam>& beams = pending_->scan->beams;
  Returns returns;
  returns.scan_id = pending_->id;
  returns.beams_before = static_cast<std::uint32_t>(pending_->next);
  returns.device_time = beams[pending_->next].utime;
  for (std::size_t& i = pending_->next;
       i < beams.size() && returns.beams.size() < beams_per_message_; ++i) {
    returns.beams.push_back(beams[i].beam);
    returns.beams.back().after_us =
        static_cast<std::uint32_t>(beams[i].utime - returns.device_time);
  }
  const bool last = pending_->next == beams.size();
  events_.message(returns);
  if (!pending_) return;
  if (last) return end(ScanResult::complete);
  timer_ = loop_.after(message_period, [this] { send_beams(); });
}

void FolderAdapter::end(ScanResult result) {
  ScanEnd message;
  message.scan_id = pending_->id;
  message.result = result;
  message.beams = static_cast<std::uint32_t>(pending_->next);
  message.device_time = system_now();
  pending_.reset();
  events_.message(message);
}

void FolderAdapter::cancel(std::int64_t scan_id) {
  if (!pending_ || pending_->id != scan_id) return;
  loop_.cancel(timer_);
  timer_ = loop_.after(0, [this] {
    if (pending_) end(ScanResult::cancelled);
  });
}

void FolderAdapter::drop(const std::string& reason) {
  loop_.cancel(timer_);
  pending_.reset();
  reason_ = reason;
  watch_timer_ = loop_.after(again, [this] { watch(); });
  events_.lost(reason);
}

}  // namespace berth::lidar
