// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <zlib.h>
#include <zstd.h>

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// Reads an MCAP file by the specification (mcap.dev/spec) and checks every length, offset, index,
/// count and checksum. Shares nothing with the writer. Any fault throws.
namespace berth::mcap_check {

struct Fault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline void expect(bool condition, const std::string& what) {
  if (!condition) throw Fault(what);
}

class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  T number() {
    T value = 0;
    const std::string_view b = take(sizeof(T));
    for (std::size_t i = sizeof(T); i-- > 0;) {
      value =
          static_cast<T>(static_cast<std::uint64_t>(value) << 8 | static_cast<std::uint8_t>(b[i]));
    }
    return value;
  }
  std::string_view text() { return take(number<std::uint32_t>()); }
  std::string_view take(std::size_t n) {
    expect(n <= rest_.size(), "a record is too short");
    const std::string_view taken = rest_.substr(0, n);
    rest_.remove_prefix(n);
    return taken;
  }
  bool at_end() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
};

struct Record {
  int opcode;
  std::string_view content;
  std::uint64_t at;
  std::uint64_t bytes;
};

inline std::vector<Record> records_of(std::string_view bytes, std::uint64_t begin) {
  std::vector<Record> records;
  Cursor cursor(bytes);
  while (!cursor.at_end()) {
    const std::uint64_t at = begin + bytes.size() - cursor.left();
    const int opcode = cursor.number<std::uint8_t>();
    const auto length = cursor.number<std::uint64_t>();
    records.push_back({opcode, cursor.take(length), at, 9 + length});
    if (opcode == 0x02) break;  // the footer is the last
  }
  return records;
}

struct Message {
  std::string topic;
  std::uint64_t log_time;
  std::string data;
};

struct Contents {
  std::map<std::string, std::string> schema_of_topic;  ///< names
  std::map<std::string, std::string> schemas;          ///< name to data
  std::vector<Message> messages;                       ///< in the file's order
  int chunks = 0;
};

inline std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

class Reader {
 public:
  explicit Reader(std::string_view file) : file_(file) {}

  Contents read() {
    constexpr std::string_view magic("\x89MCAP0\r\n", 8);
    expect(file_.substr(0, 8) == magic && file_.substr(file_.size() - 8) == magic, "magic");
    const auto records = records_of(file_.substr(8, file_.size() - 16), 8);
    expect(records.front().opcode == 0x01, "the header is not first");
    expect(records.back().opcode == 0x02 && records.back().bytes == 29, "footer");
    for (const Record& r : records) {
      if (summary_start_ == 0) {
        data_record(r);
      } else {
        summary_record(r);
      }
    }
    expect(pending_index_.empty(), "a chunk's message is in no index");
    return std::move(contents_);
  }

 private:
  void data_record(const Record& r) {
    Cursor c(r.content);
    switch (r.opcode) {
      case 0x03: {
        const auto id = c.number<std::uint16_t>();
        expect(id != 0, "schema 0");
        const std::string name(c.text());
        expect(c.text() == "jsonschema", "encoding of a schema");
        schema_names_[id] = name;
        contents_.schemas[name] = c.text();
        schema_records_.push_back(r.content);
        break;
      }
      case 0x04: {
        const auto id = c.number<std::uint16_t>();
        const auto schema = c.number<std::uint16_t>();
        expect(schema_names_.contains(schema), "a channel before its schema");
        topics_[id] = std::string(c.text());
        expect(c.text() == "json", "encoding of messages");
        contents_.schema_of_topic[topics_[id]] = schema_names_[schema];
        channel_records_.push_back(r.content);
        break;
      }
      case 0x06:
        chunk(r);
        break;
      case 0x07:
        message_index(r);
        break;
      case 0x0F: {
        const auto crc = c.number<std::uint32_t>();
        expect(crc == crc_of(file_.substr(0, r.at)), "checksum of the data section");
        summary_start_ = r.at + r.bytes;
        break;
      }
      default:
        expect(r.opcode == 0x01, "a record that has no place in the data section");
    }
  }

  void chunk(const Record& r) {
    expect(pending_index_.empty(), "a chunk's message is in no index");
    Cursor c(r.content);
    Chunk chunk{c.number<std::uint64_t>(), c.number<std::uint64_t>(), r.at, r.bytes, 0, {}, 0, 0};
    chunk.uncompressed = c.number<std::uint64_t>();
    const auto crc = c.number<std::uint32_t>();
    expect(c.text() == "zstd", "compression");
    chunk.compressed = c.number<std::uint64_t>();
    const std::string_view packed = c.take(chunk.compressed);
    expect(c.at_end(), "a chunk is too long");
    std::string plain(chunk.uncompressed, '\0');
    expect(
        ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size()) == plain.size(),
        "zstd");
    expect(crc == crc_of(plain), "checksum of a chunk");
    std::uint64_t first = UINT64_MAX;
    std::uint64_t last = 0;
    for (const Record& m : records_of(plain, 0)) {
      expect(m.opcode == 0x05, "a record in a chunk that is no message");
      Cursor fields(m.content);
      const auto channel = fields.number<std::uint16_t>();
      const auto sequence = fields.number<std::uint32_t>();
      const auto log_time = fields.number<std::uint64_t>();
      fields.number<std::uint64_t>();
      expect(topics_.contains(channel), "a message before its channel");
      expect(sequence == counts_[channel]++, "sequence");
      first = std::min(first, log_time);
      last = std::max(last, log_time);
      pending_index_[channel].push_back({log_time, m.at});
      contents_.messages.push_back(
          {topics_[channel], log_time, std::string(fields.take(fields.left()))});
    }
    expect(first == chunk.first && last == chunk.last, "times of a chunk");
    chunks_.push_back(chunk);
    ++contents_.chunks;
  }

  void message_index(const Record& r) {
    Cursor c(r.content);
    const auto channel = c.number<std::uint16_t>();
    Cursor entries(c.text());
    const auto& expected = pending_index_[channel];
    expect(entries.left() == expected.size() * 16 && !expected.empty(), "size of a message index");
    for (const auto& [time, offset] : expected) {
      expect(entries.number<std::uint64_t>() == time, "time in a message index");
      expect(entries.number<std::uint64_t>() == offset, "offset in a message index");
    }
    pending_index_.erase(channel);
    chunks_.back().index_offsets[channel] = r.at;
    chunks_.back().index_bytes += r.bytes;
  }

  void summary_record(const Record& r) {
    Cursor c(r.content);
    if (r.opcode != 0x0E && r.opcode != 0x02) {
      if (groups_.empty() || groups_.back().opcode != r.opcode)
        groups_.push_back({r.opcode, {}, r.at, 0});
      groups_.back().bytes += r.bytes;
    }
    switch (r.opcode) {
      case 0x03:
        expect(r.content == schema_records_.at(summary_schemas_++), "schema in the summary");
        break;
      case 0x04:
        expect(r.content == channel_records_.at(summary_channels_++), "channel in the summary");
        break;
      case 0x08: {
        const Chunk& chunk = chunks_.at(summary_chunks_++);
        expect(
            c.number<std::uint64_t>() == chunk.first && c.number<std::uint64_t>() == chunk.last &&
                c.number<std::uint64_t>() == chunk.at && c.number<std::uint64_t>() == chunk.bytes,
            "chunk index");
        Cursor offsets(c.text());
        expect(offsets.left() == 10 * chunk.index_offsets.size(), "message index offsets");
        for (const auto& [channel, at] : chunk.index_offsets) {
          expect(
              offsets.number<std::uint16_t>() == channel && offsets.number<std::uint64_t>() == at,
              "message index offset");
        }
        expect(c.number<std::uint64_t>() == chunk.index_bytes, "message index length");
        expect(c.text() == "zstd" && c.number<std::uint64_t>() == chunk.compressed &&
                   c.number<std::uint64_t>() == chunk.uncompressed,
               "sizes in a chunk index");
        break;
      }
      case 0x0B: {
        expect(c.number<std::uint64_t>() == contents_.messages.size(), "message count");
        expect(c.number<std::uint16_t>() == schema_records_.size(), "schema count");
        expect(c.number<std::uint32_t>() == channel_records_.size(), "channel count");
        expect(c.number<std::uint32_t>() == 0 && c.number<std::uint32_t>() == 0, "no attachments");
        expect(c.number<std::uint32_t>() == chunks_.size(), "chunk count");
        c.number<std::uint64_t>();
        c.number<std::uint64_t>();
        Cursor counts(c.text());
        while (!counts.at_end()) {
          const auto channel = counts.number<std::uint16_t>();
          expect(counts.number<std::uint64_t>() == counts_[channel], "count of a channel");
        }
        break;
      }
      case 0x0E: {
        if (offset_start_ == 0) offset_start_ = r.at;
        const Record& group = groups_.at(summary_groups_++);
        expect(c.number<std::uint8_t>() == group.opcode && c.number<std::uint64_t>() == group.at &&
                   c.number<std::uint64_t>() == group.bytes,
               "summary offset");
        break;
      }
      case 0x02: {
        expect(c.number<std::uint64_t>() == summary_start_, "start of the summary");
        expect(c.number<std::uint64_t>() == offset_start_, "start of the summary offsets");
        const std::uint64_t end = r.at + 9 + 16;
        expect(
            c.number<std::uint32_t>() == crc_of(file_.substr(summary_start_, end - summary_start_)),
            "checksum of the summary");
        expect(summary_groups_ == groups_.size() && summary_chunks_ == chunks_.size() &&
                   summary_schemas_ == schema_records_.size() &&
                   summary_channels_ == channel_records_.size(),
               "the summary is not whole");
        break;
      }
      default:
        throw Fault("a record that has no place in the summary");
    }
  }

  struct Chunk {
    std::uint64_t first, last, at, bytes, index_bytes;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
    std::uint64_t compressed, uncompressed;
  };

  std::string_view file_;
  Contents contents_;
  std::map<std::uint16_t, std::string> schema_names_;
  std::map<std::uint16_t, std::string> topics_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::vector<std::string_view> schema_records_;
  std::vector<std::string_view> channel_records_;
  std::vector<Chunk> chunks_;
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> pending_index_;
  std::vector<Record> groups_;
  std::uint64_t summary_start_ = 0;
  std::uint64_t offset_start_ = 0;
  std::size_t summary_schemas_ = 0;
  std::size_t summary_channels_ = 0;
  std::size_t summary_chunks_ = 0;
  std::size_t summary_groups_ = 0;
};

}  // namespace berth::mcap_check
