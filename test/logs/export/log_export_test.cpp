// SPDX-License-Identifier: BSD-3-Clause
#include <berth/event_t.hpp>
#include <berth/node_status_t.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/clouds/cloud.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"
#include "lcmtypes/scan_packet.h"
#include "logs/export/cloud_files.h"
#include "logs/export/csv.h"
#include "logs/export/json_text.h"
#include "logs/export/mcap.h"
#include "logs/file/log_event.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/evaluation/measure/made_run.h"
#include "test/logs/export/mcap_check.h"
#include "test/logs/file/made_log.h"

using namespace berth;
using namespace berth::logs;

namespace {

namespace fs = std::filesystem;

bool all(std::string_view) { return true; }

ScanPacket packet(std::int64_t scan_id, int number, int count, bool last) {
  ScanPacket m{};
  m.utime = made::start + scan_id * second + number * 1000;
  m.session = made::session;
  m.scan_id = scan_id;
  m.packet = number;
  m.scan_status = last ? ScanPacket::COMPLETE : ScanPacket::RUNNING;
  m.resize(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < m.status.size(); ++i) {
    m.time_us[i] = static_cast<std::int32_t>(10 * i);
    m.range_m[i] = 5 + 0.01F * static_cast<float>(i);
    m.azimuth_rad[i] = 0.1F + 0.001F * static_cast<float>(i);
    m.elevation_rad[i] = -0.2F;
    m.intensity[i] = static_cast<std::int16_t>(100 + i);
    m.status[i] = i % 10 == 9 ? ScanPacket::MISS : ScanPacket::HIT;
  }
  return m;
}

void write_scans(const fs::path& path) {
  LogWriter writer(path);
  for (int k = 0; k < 20; ++k) {
    const Utime utime = made::start + k * second;
    write_message(writer, utime, "GROUND_TRUTH", made::truth(utime, made::flight(k)));
    node_status_t status{};
    status.utime = utime;
    status.node = "a, \"b\"";
    status.counter_count = k % 3;
    for (int c = 0; c < k % 3; ++c) status.counters.push_back({"n" + std::to_string(c), c + 0.5});
    write_message(writer, utime + 1, "NODE_STATUS", status);
    write_message(writer, utime + 2, "SCAN_DATA", packet(k, 0, 100, false));
    write_message(writer, utime + 3, "SCAN_DATA", packet(k, 1, k == 19 ? 5 : 50, true));
  }
  event_t event{};
  event.utime = made::start;
  event.severity = event_t::WARNING;
  event.node = "arm";
  event.code = "late";
  event.text = "\xff odd bytes";
  write_message(writer, made::start, "EVENT", event);
  writer.write(made::start, "FOREIGN", std::vector<std::uint8_t>(20, 7));
}

std::vector<std::string> lines_of(const fs::path& path) {
  std::istringstream in(read_file(path));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

TEST_CASE("tables have a file for each channel, units in the header, arrays in columns") {
  TemporaryFile log;
  TemporaryDirectory out;
  write_scans(log.path);
  std::vector<std::string> left_out;
  const auto files = export_csv(log.path, out.path() / "csv", our_types(), all, left_out);
  CHECK(files.size() == 4);
  CHECK(left_out == std::vector<std::string>{"FOREIGN (1 messages)"});
  const auto truth = lines_of(out.path() / "csv/GROUND_TRUTH.csv");
  REQUIRE(truth.size() == 21);
  CHECK(truth[0].rfind("log_utime [us],utime [us],seq,session,position_m[0] [m],", 0) == 0);
  CHECK(truth[0].find(",linear_velocity_m_s[2] [m/s],") != std::string::npos);
  CHECK(truth[3].find(",4.96,") != std::string::npos);  // 5 - 0.02 * 2
  const auto status = lines_of(out.path() / "csv/NODE_STATUS.csv");
  CHECK(status[0].find("counters[0].name,counters[0].value,counters[1].name,counters[1].value") !=
        std::string::npos);
  CHECK(status[1].find("\"a, \"\"b\"\"\"") != std::string::npos);
  CHECK(status[1].substr(status[1].size() - 5) == "0,,,,");
  CHECK(status[3].substr(status[3].size() - 14) == ",n0,0.5,n1,1.5");
  // Long arrays of one size make rows.
  const auto scan = lines_of(out.path() / "csv/SCAN_DATA.csv");
  CHECK(scan.size() == 1 + 20 * 150 - 45);
  CHECK(scan[0].rfind("log_utime [us],index,utime [us],", 0) == 0);
  CHECK(scan[0].find(",time_us [us],origin_x_m [m],") != std::string::npos);
  CHECK(scan[0].find(",range_m [m],range_sigma_m [m],") != std::string::npos);
  CHECK(scan[100].find(",99,") != std::string::npos);
}

TEST_CASE("channels whose names differ in a sign have tables of their own; one that fails, alone") {
  TemporaryFile log;
  {
    LogWriter writer(log.path);
    const auto truth = made::truth(made::start, made::flight(0));
    for (const char* channel :
         {"a/b", "a_b", "A_B", "a b", "../up", ".", "", "caf\xC3\xA9", "x\xE9"}) {
      write_message(writer, made::start, channel, truth);
    }
  }
  TemporaryDirectory out;
  write_file(out.path() / "a b.csv", "of somebody else");
  std::vector<std::string> left_out;
  const auto files = export_csv(log.path, out.path(), our_types(), all, left_out);
  REQUIRE(files.size() == 9);
  std::map<std::string, std::string> names;
  for (const CsvFile& file : files) {
    CHECK(file.path.parent_path() == out.path());
    if (file.channel == "a b") {
      CHECK_THAT(file.failure, Catch::Contains("a b.csv"));
    } else {
      CHECK(file.failure.empty());
      CHECK(file.rows == 1);
      CHECK(lines_of(file.path).size() == 2);
    }
    names[file.channel] = file.path.filename().string();
  }
  CHECK(read_file(out.path() / "a b.csv") == "of somebody else");
  CHECK(names["a_b"] == "a_b-2.csv");  // "A_B" came first; a file system may not distinguish them
  CHECK(names["A_B"] == "A_B.csv");
  CHECK(names["a/b"] == "a_b-3.csv");
  CHECK(names["../up"] == "_._up.csv");
  CHECK(names["caf\xC3\xA9"] == "caf\xC3\xA9.csv");
  // None of it twice: the second time all are there.
  for (const CsvFile& file : export_csv(log.path, out.path(), our_types(), all, left_out)) {
    CHECK_FALSE(file.failure.empty());
  }
}

TEST_CASE("scans whose numbers come again have files of their own") {
  TemporaryFile log;
  {
    LogWriter writer(log.path);
    for (int i = 0; i < 3; ++i)
      write_message(writer, made::start, "SCAN_DATA", packet(7, 0, 9, true));
  }
  TemporaryDirectory out;
  CHECK(export_clouds(log.path, out.path(), {CloudFormat::pcd}).scans == 3);
  CHECK(fs::exists(out.path() / "session_7_scan_000007-3.pcd"));
  const CloudExport again = export_clouds(log.path, out.path(), {CloudFormat::pcd});
  CHECK(again.scans == 0);
  CHECK(again.failed == 3);
  CHECK_THAT(again.failure, Catch::Contains("session_7_scan_000007.pcd"));
}

TEST_CASE("MCAP is valid whatever names and times a log has") {
  TemporaryFile log;
  {
    LogWriter writer(log.path);
    for (const Utime utime : {made::start, Utime{-7}, Utime{INT64_MAX}, Utime{INT64_MIN}}) {
      write_message(writer, utime, "x\xE9 \x01", made::truth(utime, made::flight(0)));
    }
  }
  TemporaryDirectory out;
  const McapExport result = export_mcap(log.path, out.path() / "a.mcap", our_types(), all);
  const std::string bytes = read_file(out.path() / "a.mcap");
  const auto contents = mcap_check::Reader(bytes).read();
  CHECK(contents.messages.size() == result.messages);
  for (const auto& message : contents.messages) {
    CHECK_NOTHROW(nlohmann::json(message.topic).dump());  // strict: only UTF-8
    CHECK_NOTHROW(nlohmann::json::parse(message.data));
  }
}

TEST_CASE("scans as clouds come back with their points, times and all") {
  const auto format = GENERATE(CloudFormat::pcd, CloudFormat::ply);
  const std::string extension = format == CloudFormat::pcd ? ".pcd" : ".ply";
  TemporaryFile log;
  TemporaryDirectory out;
  write_scans(log.path);
  const CloudExport result = export_clouds(log.path, out.path() / "clouds", {format});
  CHECK(result.scans == 20);
  CHECK(result.points == 19 * 135 + 95);
  const auto cloud = clouds::read_cloud(out.path() / ("clouds/session_7_scan_000003" + extension));
  REQUIRE(cloud.beams.size() == 135);
  CHECK(cloud.has_times);
  for (std::size_t i = 0; i < 9; ++i) {
    const clouds::CloudBeam& beam = cloud.beams[i];
    CHECK(beam.range == Approx(5 + 0.01 * static_cast<double>(i)).epsilon(1e-6));
    CHECK(beam.azimuth == Approx(0.1 + 0.001 * static_cast<double>(i)).epsilon(1e-6));
    CHECK(beam.elevation == Approx(-0.2).epsilon(1e-6));
  }
  CHECK(cloud.beams[1].utime - cloud.beams[0].utime == 10);
  CHECK(cloud.beams[90].utime - cloud.beams[0].utime == 1000);
  const std::string text = read_file(out.path() / ("clouds/session_7_scan_000003" + extension));
  CHECK(text.find("intensity") != std::string::npos);
}

TEST_CASE("both returns of a beam are points, with all their fields") {
  const auto format = GENERATE(CloudFormat::pcd, CloudFormat::ply);
  TemporaryFile log;
  TemporaryDirectory out;
  ScanPacket scan = packet(3, 0, 2, true);
  scan.origin_x_m[0] = 0.5F;
  scan.range_sigma_m = {0.01F, 0.02F};
  scan.ambient[0] = 20;
  scan.range2_m[0] = 8;
  {
    LogWriter writer(log.path);
    write_message(writer, made::start, "SCAN_DATA", scan);
  }
  CHECK(export_clouds(log.path, out.path(), {format}).points == 3);
  const std::string file =
      std::string("session_7_scan_000003") + (format == CloudFormat::pcd ? ".pcd" : ".ply");
  const auto cloud = clouds::read_cloud(out.path() / file);
  REQUIRE(cloud.beams.size() == 2);  // an estimator that reads clouds takes a beam's first return
  CHECK(cloud.counts.later_returns == 1);
  CHECK(cloud.has_sigmas);
  CHECK(cloud.beams[1].range_sigma == Approx(0.02));
  CHECK(cloud.beams[0].range == Approx(scan.point(0, 5).norm()));
  CHECK(cloud.beams[0].range > 5.05);
}

TEST_CASE("scans of the older type are those of today with fewer fields") {
  scan_packet_t older{};
  older.utime = made::start;
  older.session = made::session;
  older.scan_id = 3;
  older.packet = 4;
  older.scan_status = scan_packet_t::ABORTED;
  older.reason = "the fence";
  older.window = 1;
  older.beams_before = 150;
  older.count = 2;
  older.time_us = {0, 10};
  older.range_m = {5, 0};
  older.azimuth_rad = {0.1F, 0.2F};
  older.elevation_rad = {-0.1F, 0};
  older.intensity = {100, 0};
  older.status = {scan_packet_t::HIT, scan_packet_t::MISS};
  const auto bytes = encoded(older);
  ReusedMessage<ScanPacket> reused;
  ScanPacket today = packet(3, 0, 5, true);
  today.range2_m[1] = 9;
  REQUIRE(reused.decode(encoded(today)) != nullptr);  // nothing of it stays
  for (const ScanPacket& read : {*decode<ScanPacket>(bytes), *reused.decode(bytes)}) {
    CHECK(read.scan_id == 3);
    CHECK(read.packet == 4);
    CHECK(read.scan_status == ScanPacket::ABORTED);
    CHECK(read.reason == "the fence");
    CHECK(read.window == 1);
    CHECK(read.beams_before == 150);
    CHECK(read.range_m == older.range_m);
    CHECK(read.intensity == older.intensity);
    CHECK(read.status == older.status);
    for (const auto& zero : {read.origin_x_m, read.ambient, read.range_sigma_m, read.range2_m}) {
      CHECK(zero == std::vector<float>{0, 0});
    }
    CHECK(encoded(read).size() > bytes.size());  // it is whole
  }
  older.count = 0;
  for (auto* all : {&older.range_m, &older.azimuth_rad, &older.elevation_rad}) all->clear();
  CHECK(reused.decode(encoded(older))->status.empty());
  const std::vector<std::uint8_t> cut(bytes.begin(), bytes.end() - 1);
  CHECK_FALSE(decode<ScanPacket>(cut));
  CHECK_FALSE(decode<ScanPacket>(encoded(event_t{})));
}

TEST_CASE("MCAP: every checksum, offset and count is right, and every message is there") {
  TemporaryFile log;
  TemporaryDirectory out;
  write_scans(log.path);
  const fs::path file = out.path() / "run.mcap";
  const McapExport result = export_mcap(log.path, file, our_types(), all);
  CHECK(result.unknown == 1);
  const std::string bytes = read_file(file);
  const auto contents = mcap_check::Reader(bytes).read();
  CHECK(contents.messages.size() == result.messages);
  CHECK(contents.chunks >= 1);
  CHECK(contents.schema_of_topic.at("GROUND_TRUTH") == "berth.ground_truth_t");
  CHECK(contents.schema_of_topic.at("/berth/truth") == "foxglove.PoseInFrame");
  CHECK(contents.schema_of_topic.at("/berth/scan") == "foxglove.PointCloud");
  std::map<std::string, int> counts;
  for (const auto& message : contents.messages) {
    ++counts[message.topic];
    const auto json = nlohmann::json::parse(message.data);  // throws unless it is JSON
    // Each property is in the schema.
    const auto schema =
        nlohmann::json::parse(contents.schemas.at(contents.schema_of_topic.at(message.topic)));
    for (const auto& [key, value] : json.items()) CHECK(schema["properties"].contains(key));
  }
  CHECK(counts["GROUND_TRUTH"] == 20);
  CHECK(counts["/berth/truth"] == 20);
  CHECK(counts["/berth/scan"] == 20);
  CHECK(counts["SCAN_DATA"] == 40);
  CHECK(counts["/tf"] == 21);
  CHECK(counts["/berth/log"] == 1);
  // The checker does find faults.
  for (const std::size_t at : {bytes.size() / 2, bytes.size() - 20, std::size_t{30}}) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    CHECK_THROWS(mcap_check::Reader(damaged).read());
  }
}

TEST_CASE("JSON written directly is the JSON of the tree") {
  node_status_t status{};
  status.utime = 1763730000123456;
  status.reason = "caf\xc3\xa9 \"x\"\n\xff";
  status.counter_count = 2;
  status.counters = {{"nan", std::nan("")}, {"third", 1.0 / 3}};
  const auto bytes = encoded(status);
  const StructType& type = *our_types().type_of(bytes);
  const auto value = decode_value(type, bytes);
  REQUIRE(value);
  std::string text;
  append_json(type, *value, text);
  CHECK(nlohmann::json::parse(text) == nlohmann::json::parse(json_text(json_of(type, *value))));
}
