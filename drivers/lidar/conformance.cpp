// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/conformance.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "common/bus/clock_map.h"
#include "common/core/error.h"
#include "common/core/statistics.h"
#include "common/core/text.h"
#include "drivers/lidar/conformance_peer.h"
#include "drivers/lidar/limits.h"

namespace berth::lidar {
namespace {

using Received = ConformancePeer::Received;
using Outcome = ConformanceCheck::Outcome;

/// Time limit of immediate answers: the driver's period of StatusQuery.
constexpr Utime at_once = 250 * millisecond;
/// Silence after which the driver gives up a device or a running scan.
constexpr Utime silence = 1 * second;
/// "no later than some 25 ms after they were" fired, plus the driver's tolerance of the clock map.
constexpr Utime max_age = 25 * millisecond + clock_tolerance;

std::string ms(Utime t) {
  return fixed(1e-3 * static_cast<double>(t), t < 10 * millisecond ? 2 : 1) + " ms";
}

std::string version_text(int version) { return "version " + std::to_string(version); }

/// Messages that answer one order.
struct ScanRecord {
  ScanOrder order;
  Utime sent = 0;
  std::optional<ScanAnswer> answer;
  Utime answer_took = 0;
  std::vector<Received> returns;
  std::optional<ScanEnd> end;

  std::uint32_t beams() const {
    std::uint32_t n = 0;
    for (const Received& h : returns) {
      n += static_cast<std::uint32_t>(std::get<Returns>(h.message).beams.size());
    }
    return n;
  }
};

class Conformance {
 public:
  Conformance(const std::string& address,
              const std::function<void(const ConformanceCheck&)>& report)
      : address_(address), report_(report) {}

  bool run() {
    test_silence_before_hello();
    if (!test_greeting()) return false;
    test_versions();
    const auto peer = greeted(version_);
    if (!peer) {
      failed("again: Hello", "a further connection is not greeted",
             "serve one host after the other");
      return false;
    }
    test_status(*peer);
    test_scan(*peer, version_);
    test_patterns(*peer);
    test_running_scan(*peer);
    test_refusals(*peer);
    test_second_host();
    if (version_ > 1) {
      const auto older = greeted(1);
      if (older) test_scan(*older, 1);
    } else {
      skipped("version 1: scan", "the device speaks no newer one: tested above");
    }
    test_malformed();
    return failures_ == 0;
  }

 private:
  // ---- reporting ----

  void ok(const std::string& name, const std::string& found) { report_({name, {}, found, {}}); }
  void failed(const std::string& name, const std::string& found, const std::string& mend) {
    ++failures_;
    report_({name, Outcome::failed, found, mend});
  }
  void skipped(const std::string& name, const std::string& why) {
    report_({name, Outcome::skipped, why, {}});
  }
  /// fault: empty when the check passes; then `found` is reported.
  void check(const std::string& name, const std::string& fault, const std::string& found,
             const std::string& mend) {
    fault.empty() ? ok(name, found) : failed(name, fault, mend);
  }

  // ---- connections ----

  std::unique_ptr<ConformancePeer> connect() {
    std::unique_ptr<ConformancePeer> peer;
    loop_.sockets().dial(address_, [&](Socket socket) {
      peer = std::make_unique<ConformancePeer>(loop_, std::move(socket));
      loop_.stop();
    });
    while (!peer) loop_.run();
    if (!peer->connected()) {
      const std::string trouble = loop_.sockets().trouble(address_);
      throw InputError((trouble.empty() ? "no answer from " + address_ : trouble) +
                       "; expected a LIDAR or a bridge that listens there");
    }
    return peer;
  }
  std::unique_ptr<ConformancePeer> greeted(int version) {
    auto peer = connect();
    peer->send(Hello{static_cast<std::uint16_t>(version)});
    if (!peer->await<Identity>(0, silence)) return nullptr;
    return peer;
  }

  // ---- greeting ----

  void test_silence_before_hello() {
    const auto peer = connect();
    peer->send(StatusQuery{1});
    const auto status = peer->await<Status>(0, at_once);
    check("before Hello", status ? "a StatusQuery is answered before any Hello" : "",
          peer->closed() ? "the connection is closed" : "nothing is answered",
          "answer nothing but Hello; close the connection, with a Complaint");
  }

  bool test_greeting() {
    auto peer = connect();
    const Utime sent = peer->send(Hello{});
    auto received = peer->await<Identity>(0, silence);
    if (!received && peer->closed()) {
      peer = connect();
      peer->send(Hello{1});
      received = peer->await<Identity>(0, silence);
    }
    const char* mend = "answer Hello with Identity (0x81) at once";
    if (!received) {
      failed("Hello",
             !peer->damage().empty() ? peer->damage()
             : peer->closed()        ? "the connection is closed"
                                     : "no Identity within " + ms(silence),
             mend);
      return false;
    }
    identity_ = std::get<Identity>(received->message);
    version_ = identity_.version;
    check("Hello",
          version_ < 1 || version_ > protocol_version
              ? "answered with " + version_text(version_) + ", expected 1 to " +
                    std::to_string(protocol_version)
              : "",
          identity_.model + " " + identity_.serial + ", " + version_text(version_) + ", after " +
              ms(received->at - sent),
          "Identity's version is at most Hello's");
    version_ = std::clamp<int>(version_, 1, protocol_version);
    test_identity();
    return usable_;
  }

  void test_identity() {
    std::string fault;
    const auto expect = [&](bool good, const std::string& what) {
      if (!good) fault += (fault.empty() ? "" : "; ") + what;
    };
    const Identity& id = identity_;
    expect(!id.model.empty(), "no model");
    expect(id.rate_hz > 0, "beams per second: " + fixed(id.rate_hz, 3));
    expect(id.range_min_m >= 0 && id.range_max_m > id.range_min_m,
           "range " + fixed(id.range_min_m, 3) + " to " + fixed(id.range_max_m, 3) + " m");
    const double* field = id.field_of_view_rad;
    expect(field[0] > 0 && field[0] <= 2 * M_PI && field[1] > 0 && field[1] <= M_PI,
           "field of view " + fixed(field[0], 3) + " x " + fixed(field[1], 3) + " rad");
    expect(id.minimum_step_rad >= 0, "minimum step " + fixed(id.minimum_step_rad, 6) + " rad");
    usable_ = fault.empty();
    check("Identity", fault,
          fixed(id.rate_hz, 0) + " beams/s, " + fixed(id.range_min_m, 1) + " to " +
              fixed(id.range_max_m, 1) + " m, " + fixed(degrees(field[0]), 1) + " x " +
              fixed(degrees(field[1]), 1) + " deg",
          "state the true model, beams per second, ranges (m), field of view and step (rad)");
  }

  void test_versions() {
    for (const int requested : {1, 9}) {
      const auto peer = connect();
      peer->send(Hello{static_cast<std::uint16_t>(requested)});
      const auto received = peer->await<Identity>(0, silence);
      const int expected = std::min(requested, version_);
      const int got = received ? std::get<Identity>(received->message).version : 0;
      if (requested > protocol_version && !received && peer->closed()) {
        skipped("Hello of version 9", "the connection is closed: no driver speaks it yet");
        continue;
      }
      check("Hello of " + version_text(requested),
            got == expected
                ? ""
                : (received ? "answered with " + version_text(got) : std::string("no Identity")) +
                      ", expected " + version_text(expected),
            "answered with " + version_text(got), "answer in the newest version that both speak");
    }
  }

  // ---- clock ----

  void test_status(ConformancePeer& peer) {
    std::vector<Utime> round_trips;
    std::string content;
    std::string unsteady;
    for (std::uint32_t i = 0; i < 9; ++i) {
      const std::uint32_t token = 0xfedcba90 + i;
      const std::size_t from = peer.received().size();
      const Utime sent = peer.send(StatusQuery{token});
      const auto received = peer.await<Status>(from, silence);
      if (!received) {
        failed("StatusQuery", "no Status within " + ms(silence),
               "answer each StatusQuery at once with Status (0x85)");
        return;
      }
      const Status& status = std::get<Status>(received->message);
      if (status.token != token) {
        content = "token " + std::to_string(status.token) + ", expected " + std::to_string(token);
      } else if (status.state != DeviceState::idle) {
        content = "not idle, though nothing was ordered: " + status.reason;
      }
      round_trips.push_back(received->at - sent);
      if (!clock_.add(sent, status.device_time, received->at)) {
        unsteady = "reading " + std::to_string(i + 1) + " of 9 fits no line through those before";
      }
      peer.wait([&] { return peer.closed(); }, at_once - std::min(at_once, received->at - sent));
    }
    check("Status", content, "token comes back, idle", "return the query's token and your state");
    std::sort(round_trips.begin(), round_trips.end());
    const Utime shortest = round_trips.front();
    check("Status: at once",
          round_trips.back() > at_once ? "the slowest of 9 took " + ms(round_trips.back())
          : shortest / 2 > clock_tolerance
              ? "the fastest of 9 took " + ms(shortest) +
                    ": the clock is known to no better than " + ms(shortest / 2)
              : "",
          "9 round trips of " + ms(shortest) + " to " + ms(round_trips.back()),
          "answer at once, scanning or not: within " + ms(at_once) + ", the fastest within " +
              ms(2 * clock_tolerance));
    const ClockLine line = clock_.line();
    check("device clock", unsteady,
          "stands at the host's " + std::string(line.offset < 0 ? "- " : "+ ") +
              fixed(std::abs(seconds(line.offset)), 6) + " s, +- " + fixed(1e3 * line.sigma_s, 2) +
              " ms",
          "stamp Status when it is sent, in microseconds of a clock that is never set and runs "
          "within 600 ppm of the host's");
  }

  // ---- scans ----

  Window window(double azimuth, double elevation, double width, double height,
                double duration) const {
    Window w;
    w.azimuth = azimuth * identity_.field_of_view_rad[0];
    w.elevation = elevation * identity_.field_of_view_rad[1];
    w.width = width * identity_.field_of_view_rad[0];
    w.height = height * identity_.field_of_view_rad[1];
    double count = std::clamp(identity_.rate_hz * duration, 20.0, 1e6);
    const double step = 2 * identity_.minimum_step_rad;
    if (step > 0) count = std::clamp(w.width * w.height / (step * step), 1.0, count);
    w.count = static_cast<std::int32_t>(count);
    return w;
  }

  ScanRecord order(ConformancePeer& peer, std::vector<Window> windows) {
    ScanRecord scan;
    scan.order = {++scan_id_, std::move(windows)};
    first_ = peer.received().size();
    scan.sent = peer.send(scan.order);
    if (const auto received = peer.await<ScanAnswer>(first_, silence)) {
      scan.answer = std::get<ScanAnswer>(received->message);
      scan.answer_took = received->at - scan.sent;
    }
    return scan;
  }
  /// Receives until the scan ends, or until a silence longer than the driver's time-out.
  void follow(ConformancePeer& peer, ScanRecord& scan) {
    for (std::size_t known = 0; known != peer.received().size();) {
      if (peer.find<ScanEnd>(first_)) break;
      known = peer.received().size();
      peer.wait([&] { return peer.closed() || peer.received().size() != known; }, silence);
    }
    collect(peer, scan);
  }
  void collect(const ConformancePeer& peer, ScanRecord& scan) const {
    scan.returns.clear();
    for (std::size_t i = first_; i < peer.received().size(); ++i) {
      const Message& message = peer.received()[i].message;
      if (std::holds_alternative<Returns>(message)) scan.returns.push_back(peer.received()[i]);
      if (const auto* end = std::get_if<ScanEnd>(&message)) scan.end = *end;
    }
  }
  /// Ends the scan, whatever its state.
  void give_up(ConformancePeer& peer, const ScanRecord& scan) {
    peer.send(Cancel{scan.order.scan_id});
    peer.await<ScanEnd>(first_, silence);
  }

  std::string fault_of(const ScanRecord& scan) const {
    if (!scan.answer) return "no ScanAnswer within " + ms(silence);
    if (scan.answer->scan_id != scan.order.scan_id) {
      return "ScanAnswer is of scan " + std::to_string(scan.answer->scan_id) + ", ordered was " +
             std::to_string(scan.order.scan_id);
    }
    if (!scan.answer->accepted) return "refused: " + scan.answer->reason;
    if (scan.answer_took > at_once) return "ScanAnswer came after " + ms(scan.answer_took);
    return "";
  }

  void test_scan(ConformancePeer& peer, int version) {
    const std::string of = version_text(version) + ": ";
    ScanRecord scan = order(
        peer, {window(0.125, 0.125, 0.25, 0.125, 0.4), window(-0.125, -0.125, 0.125, 0.25, 0.2)});
    const std::string fault = fault_of(scan);
    check(of + "ScanOrder", fault,
          std::to_string(scan.answer ? scan.answer->beams : 0) + " beams promised, after " +
              ms(scan.answer_took),
          "answer an order within the limits of Identity at once with ScanAnswer (0x82): "
          "accepted, with its scan id");
    if (!fault.empty()) return give_up(peer, scan);
    follow(peer, scan);
    test_sequence(of, scan, version);
    test_beams(of, scan);
    test_directions(of, scan);
    test_stamps(of, scan);
    test_end(of, scan);
    if (!scan.end) give_up(peer, scan);
  }

  void test_sequence(const std::string& of, const ScanRecord& scan, int version) {
    std::uint32_t beams = 0;
    int last_window = 0;
    const std::size_t max_beams = version == 1 ? max_beams_version_1 : max_beams_per_message;
    const int type = version == 1 ? returns_of_version_1 : returns_type;
    std::string fault = scan.returns.empty() ? "none came within " + ms(silence) : "";
    for (std::size_t i = 0; i < scan.returns.size() && fault.empty(); ++i) {
      const Returns& returns = std::get<Returns>(scan.returns[i].message);
      std::string wrong;
      if (scan.returns[i].type != type) {
        wrong = "is of type " + std::to_string(scan.returns[i].type) + ", expected " +
                std::to_string(type);
      } else if (returns.scan_id != scan.order.scan_id) {
        wrong = "is of scan " + std::to_string(returns.scan_id);
      } else if (returns.beams_before != beams) {
        wrong = "states that " + std::to_string(returns.beams_before) + " beams came before, " +
                std::to_string(beams) + " did";
      } else if (returns.window < last_window || returns.window >= scan.order.windows.size()) {
        wrong = "is of window " + std::to_string(returns.window) + " behind window " +
                std::to_string(last_window);
      } else if (returns.beams.size() > max_beams) {
        wrong = "has " + std::to_string(returns.beams.size()) + " beams, at most " +
                std::to_string(max_beams) + " are possible";
      }
      if (!wrong.empty()) fault = "message " + std::to_string(i + 1) + " " + wrong;
      last_window = returns.window;
      beams += static_cast<std::uint32_t>(returns.beams.size());
    }
    check(of + "Returns", fault,
          std::to_string(beams) + " beams in " + std::to_string(scan.returns.size()) + " messages",
          "send Returns (version 1: 0x83, 2: 0x87), each with beams of one window, in the order "
          "of firing, and count the beams sent before");
  }

  void test_beams(const std::string& of, const ScanRecord& scan) {
    std::vector<float> ranges;
    std::string fault;
    for (const Received& h : scan.returns) {
      for (const BeamReturn& beam : std::get<Returns>(h.message).beams) {
        const bool hit = beam.status == BeamStatus::hit;
        if (hit != (beam.range_m > 0)) {
          fault = hit ? "a hit has no range" : "a beam that hit nothing has a range";
        } else if (beam.intensity > 4095 || beam.intensity2 > 4095) {
          fault = "intensity " + std::to_string(std::max(beam.intensity, beam.intensity2)) +
                  " is above 4095";
        } else if (beam.range2_m < 0 || beam.range_sigma_m < 0 || beam.range2_sigma_m < 0) {
          fault = "a second range or a sigma is negative";
        }
        if (hit) ranges.push_back(beam.range_m);
      }
    }
    const double median = ranges.empty() ? 0 : double{upper_median(ranges)};
    if (fault.empty() && !ranges.empty() &&
        (median < identity_.range_min_m || median > identity_.range_max_m)) {
      fault = "half of the hits are nearer than " + fixed(median, 3) + " m, Identity states " +
              fixed(identity_.range_min_m, 3) + " to " + fixed(identity_.range_max_m, 3) + " m";
    }
    check(of + "beams", fault,
          std::to_string(ranges.size()) + " hits, the median range " + fixed(median, 3) + " m",
          "ranges in metres, 0 unless the status is hit; intensities up to 4095; nothing negative");
  }

  /// The directions of a window's beams reveal swapped axes, wrong signs and units.
  void test_directions(const std::string& of, const ScanRecord& scan) {
    std::string fault;
    for (std::size_t w = 0; w < scan.order.windows.size() && fault.empty(); ++w) {
      const Window& window = scan.order.windows[w];
      double azimuth = 0;
      double elevation = 0;
      std::size_t n = 0;
      for (const Received& h : scan.returns) {
        const Returns& returns = std::get<Returns>(h.message);
        if (returns.window != w) continue;
        for (const BeamReturn& beam : returns.beams) {
          azimuth += double{beam.azimuth_rad};
          elevation += double{beam.elevation_rad};
          ++n;
        }
      }
      if (n == 0) continue;  // reported by other checks
      azimuth /= static_cast<double>(n);
      elevation /= static_cast<double>(n);
      if (std::abs(azimuth - window.azimuth) > 0.5 * window.width ||
          std::abs(elevation - window.elevation) > 0.5 * window.height) {
        fault = "beams of window " + std::to_string(w) + " point on average to azimuth " +
                fixed(azimuth, 4) + ", elevation " + fixed(elevation, 4) +
                " rad; the window is around " + fixed(window.azimuth, 4) + ", " +
                fixed(window.elevation, 4);
      }
    }
    check(of + "directions", fault, "in their windows",
          "azimuth to the right, elevation up, both in radians and 0 on the boresight");
  }

  void test_stamps(const std::string& of, const ScanRecord& scan) {
    std::string fault;
    std::vector<Utime> ages;
    const ClockLine line = clock_.line();
    std::int64_t last = INT64_MIN;
    for (const Received& h : scan.returns) {
      const Returns& returns = std::get<Returns>(h.message);
      for (const BeamReturn& beam : returns.beams) {
        const std::int64_t device = returns.device_time + beam.after_us;
        const Utime host = line.to_host(device);
        if (device < last) {
          fault = "a beam is stamped " + ms(last - device) + " before the one fired before it";
        } else if (host < scan.sent - clock_tolerance) {
          fault = "a beam is stamped " + ms(scan.sent - host) + " before the order was sent";
        } else if (host > h.at + clock_tolerance) {
          fault = "a beam is stamped " + ms(host - h.at) + " after it arrived";
        }
        last = device;
      }
      if (!returns.beams.empty()) ages.push_back(h.at - line.to_host(returns.device_time));
    }
    check(of + "stamps", fault, "ascending, between order and arrival",
          "stamp each beam when it is fired, on the clock that Status reports, in microseconds");
    if (ages.empty()) return skipped(of + "cadence", "no returns");
    const Utime median = upper_median(ages);
    check(of + "cadence",
          fault.empty() && median > max_age
              ? "half of the messages come " + ms(median) + " or later after their first beam"
              : "",
          "half of the messages within " + ms(median) + " of their first beam, all within " +
              ms(*std::max_element(ages.begin(), ages.end())),
          "send Returns while the scan runs, no later than some 25 ms after the beams");
  }

  void test_end(const std::string& of, const ScanRecord& scan) {
    std::string fault;
    if (!scan.end) {
      fault = "none came";
    } else if (scan.end->scan_id != scan.order.scan_id) {
      fault = "it is of scan " + std::to_string(scan.end->scan_id);
    } else if (scan.end->result != ScanResult::complete) {
      fault = "the scan is not complete: " + scan.end->reason;
    } else if (scan.end->beams != scan.beams() || scan.answer->beams != scan.beams()) {
      fault = std::to_string(scan.answer->beams) + " beams promised, " +
              std::to_string(scan.beams()) + " came, ScanEnd states " +
              std::to_string(scan.end->beams);
    }
    check(of + "ScanEnd", fault, "complete, with as many beams as were promised",
          "close each accepted scan with ScanEnd (0x84): its id, its result, the beams sent");
  }

  void test_patterns(ConformancePeer& peer) {
    std::string fault;
    for (const Pattern pattern : {Pattern::spiral, Pattern::rosette, Pattern::lissajous}) {
      Window w = window(0, 0, 0.1, 0.1, 0.05);
      w.pattern = pattern;
      ScanRecord scan = order(peer, {w});
      const std::string name = "pattern " + std::to_string(static_cast<int>(pattern));
      if (scan.answer && !scan.answer->accepted && !scan.answer->reason.empty()) continue;
      const std::string wrong = fault_of(scan);
      if (wrong.empty()) follow(peer, scan);
      if (!wrong.empty() || !scan.end) {
        give_up(peer, scan);
        fault = name + ": " + (wrong.empty() ? "no ScanEnd" : wrong);
      }
    }
    check("patterns", fault, "spiral, rosette and Lissajous are scanned or refused with a reason",
          "scan each pattern, or refuse it with a reason");
  }

  void test_running_scan(ConformancePeer& peer) {
    ScanRecord scan = order(peer, {window(0, 0, 0.25, 0.25, 10)});
    const std::string fault = fault_of(scan);
    const std::size_t first = first_;
    if (!fault.empty() || !peer.await<Returns>(first, silence)) {
      failed("a running scan", fault.empty() ? "no Returns within " + ms(silence) : fault,
             "send Returns while the scan runs");
      return give_up(peer, scan);
    }
    std::size_t from = peer.received().size();
    Utime sent = peer.send(StatusQuery{77});
    const auto received = peer.await<Status>(from, silence);
    std::string status_fault;
    if (!received || received->at - sent > at_once) {
      status_fault = received ? "Status took " + ms(received->at - sent) : "no Status";
    } else if (const Status& status = std::get<Status>(received->message);
               status.state != DeviceState::scanning || status.scan_id != scan.order.scan_id) {
      status_fault = "Status has state " + std::to_string(static_cast<int>(status.state)) +
                     ", scan " + std::to_string(status.scan_id);
    }
    check("Status while scanning", status_fault, "at once, with the scan's id",
          "answer StatusQuery at once while a scan runs: state 1 and its id");

    from = peer.received().size();
    const ScanOrder second{++scan_id_, {window(0, 0, 0.1, 0.1, 0.05)}};
    peer.send(second);
    const auto answer = peer.await<ScanAnswer>(from, silence);
    std::string second_fault;
    if (!answer) {
      second_fault = "no ScanAnswer within " + ms(silence);
    } else if (const ScanAnswer& a = std::get<ScanAnswer>(answer->message);
               a.accepted || a.reason.empty() || a.scan_id != second.scan_id) {
      second_fault = a.accepted ? "accepted" : "refused without a reason or its own id";
    }
    check("a second order", second_fault, "refused, with a reason",
          "refuse an order while a scan runs, with a reason");

    from = peer.received().size();
    peer.send(Cancel{scan.order.scan_id + 1000});
    const bool ended = peer.await<ScanEnd>(from, at_once).has_value();
    check("Cancel of another scan", ended ? "the running scan has ended" : "", "does nothing",
          "end a scan for a Cancel of its own id alone");

    from = peer.received().size();
    sent = peer.send(Cancel{scan.order.scan_id});
    const auto end =
        peer.find<ScanEnd>(first) ? peer.find<ScanEnd>(first) : peer.await<ScanEnd>(from, silence);
    collect(peer, scan);
    std::string end_fault;
    if (!end) {
      end_fault = "no ScanEnd within " + ms(silence);
    } else if (!ended && scan.end->result != ScanResult::cancelled) {
      end_fault = "ScanEnd has result " + std::to_string(static_cast<int>(scan.end->result));
    } else if (!ended && end->at - sent > at_once) {
      end_fault = "ScanEnd came after " + ms(end->at - sent);
    } else if (scan.end->beams != scan.beams()) {
      end_fault = "ScanEnd states " + std::to_string(scan.end->beams) + " beams, " +
                  std::to_string(scan.beams()) + " came";
    } else {
      const std::size_t before = peer.received().size();
      peer.wait([&] { return peer.closed(); }, at_once);
      if (peer.find<Returns>(before)) end_fault = "Returns come after ScanEnd";
    }
    check("Cancel", end_fault, end ? "ScanEnd after " + ms(std::max<Utime>(end->at - sent, 0)) : "",
          "answer Cancel of the running scan at once with ScanEnd of result 1 and the beams sent; "
          "drop what was not sent");
  }

  // ---- refusals ----

  void test_refusals(ConformancePeer& peer) {
    const auto refuse = [&](const std::string& name, std::vector<Window> windows) {
      const ScanRecord scan = order(peer, std::move(windows));
      std::string fault;
      if (!scan.answer) {
        fault = "no ScanAnswer within " + ms(silence);
      } else if (scan.answer->accepted) {
        fault = "accepted";
        give_up(peer, scan);
      } else if (scan.answer->reason.empty()) {
        fault = "refused without a reason";
      } else if (scan.answer->scan_id != scan.order.scan_id) {
        fault = "refused with the id " + std::to_string(scan.answer->scan_id);
      }
      check("refuses " + name, fault, scan.answer ? scan.answer->reason : "",
            "refuse what is outside the limits with the order's id and a reason that names it");
    };
    const Window good = window(0, 0, 0.1, 0.1, 0.05);
    Window w = good;
    w.azimuth = identity_.field_of_view_rad[0];
    refuse("a window outside the field of view", {w});
    refuse("an order without windows", {});
    w = good;
    w.count = 0;
    refuse("neither count nor spacing", {w});
    w = good;
    w.width = -w.width;
    refuse("a negative width", {w});
    if (identity_.minimum_step_rad > 0) {
      w = good;
      w.count = 0;
      w.spacing = 0.5 * identity_.minimum_step_rad;
      refuse("half of the minimum step", {w});
    } else {
      skipped("refuses half of the minimum step", "Identity has no minimum step");
    }
    std::vector<Window> many(max_windows + 1, good);
    for (Window& one : many) one.count = 1;
    test_too_many(peer, many);
  }

  /// A receiver may treat more windows than the protocol allows as a malformed message.
  void test_too_many(ConformancePeer& peer, const std::vector<Window>& windows) {
    const ScanRecord scan = order(peer, windows);
    const bool accepted = scan.answer && scan.answer->accepted;
    if (accepted) give_up(peer, scan);
    check("refuses " + std::to_string(windows.size()) + " windows",
          accepted                         ? "accepted"
          : !scan.answer && !peer.closed() ? "neither refused nor the connection closed"
                                           : "",
          peer.closed() ? "the connection is closed" : "refused",
          "an order has at most " + std::to_string(max_windows) + " windows");
  }

  // ---- connections that end ----

  void test_second_host() {
    const auto first = greeted(version_);
    const auto second = greeted(version_);
    std::string fault;
    if (!first || !second) {
      fault = "the new connection is not greeted";
    } else if (!first->wait([&] { return first->closed(); }, silence)) {
      fault = "the old connection stays open";
    }
    check("a second host", fault, "takes the place of the first",
          "serve the newest connection and close the one before");
  }

  void test_malformed() {
    const auto malformed = [&](const std::string& name, std::vector<std::uint8_t> bytes) {
      const auto peer = greeted(version_);
      std::string fault;
      if (!peer) {
        fault = "a new connection is not greeted";
      } else {
        peer->send_bytes(bytes);
        if (!peer->wait([&] { return peer->closed(); }, silence)) {
          fault = "the connection stays open";
        } else if (!peer->find<Complaint>(0)) {
          fault = "the connection is closed without a Complaint";
        }
      }
      std::string found;
      if (fault.empty()) found = std::get<Complaint>(peer->find<Complaint>(0)->message).reason;
      check("malformed: " + name, fault, found,
            "give the reason with a Complaint (0x86), then close the connection");
    };
    std::vector<std::uint8_t> damaged = encode(StatusQuery{1});
    damaged.back() ^= 1;
    malformed("check sum", damaged);
    malformed("unknown type", frame_of(0x55, {}));
    malformed("too long", frame_of(0x04, std::vector<std::uint8_t>(5)));
    const auto peer = greeted(version_);
    check("serves again", peer ? "" : "no Identity", "after all this",
          "go on listening, whatever a host has sent");
  }

  std::string address_;
  const std::function<void(const ConformanceCheck&)>& report_;
  ProcessLoop loop_{clock_offset_now()};
  int failures_ = 0;
  Identity identity_;
  int version_ = protocol_version;
  bool usable_ = true;
  ClockMap clock_;
  std::int64_t scan_id_ = 0;
  std::size_t first_ = 0;  // message of the last order
};

}  // namespace

bool test_conformance(const std::string& address,
                      const std::function<void(const ConformanceCheck&)>& report) {
  return Conformance(address, report).run();
}

}  // namespace berth::lidar
