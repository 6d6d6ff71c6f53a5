// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/mcap_writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <stdexcept>

#include "common/core/valid_text.h"

namespace berth::logs {
namespace {

// Names and layouts: mcap.dev/spec, "Records".
enum Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics_record = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

constexpr std::string_view magic("\x89MCAP0\r\n", 8);
constexpr std::size_t chunk_bytes = std::size_t{1} << 20;
constexpr int compression_level = 1;

template <class Integer>
void append(std::string& out, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    out += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xff);
  }
}

void append_bytes(std::string& out, std::string_view bytes) {
  append(out, static_cast<std::uint32_t>(bytes.size()));
  out += bytes;
}

void append_text(std::string& out, std::string_view text) { append_bytes(out, valid_utf8(text)); }

std::string record(Opcode opcode, std::string_view content) {
  std::string out(1, static_cast<char>(opcode));
  append(out, static_cast<std::uint64_t>(content.size()));
  out += content;
  return out;
}

std::uint32_t crc_of(std::uint32_t crc, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(crc, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& path, const std::string& library)
    : file_(path) {
  put(magic);
  std::string content;
  append_text(content, "");  // profile
  append_text(content, library);
  put(record(Opcode::header, content));
}

void McapWriter::put(std::string_view bytes) {
  file_.write(bytes);
  crc_ = crc_of(crc_, bytes);
  at_ += bytes.size();
}

std::uint16_t McapWriter::add_schema(const std::string& name, const std::string& encoding,
                                     const std::string& data) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  std::string content;
  append(content, id);
  append_text(content, name);
  append_text(content, encoding);
  append_bytes(content, data);
  schemas_.push_back(record(Opcode::schema, content));
  put(schemas_.back());
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema_id, const std::string& topic,
                                      const std::string& encoding) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  std::string content;
  append(content, id);
  append(content, schema_id);
  append_text(content, topic);
  append_text(content, encoding);
  append(content, std::uint32_t{0});  // no metadata
  channels_.push_back({record(Opcode::channel, content), 0, ""});
  put(channels_.back().record);
  return id;
}

void McapWriter::write(std::uint16_t channel_id, Nanoseconds log_time, std::string_view data) {
  Channel& to = channels_.at(channel_id - std::size_t{1});
  append(to.index, log_time);
  append(to.index, static_cast<std::uint64_t>(chunk_.records.size()));
  std::string& out = chunk_.records;
  out += static_cast<char>(Opcode::message);
  append(out, static_cast<std::uint64_t>(2 + 4 + 8 + 8 + data.size()));
  append(out, channel_id);
  append(out, static_cast<std::uint32_t>(to.messages));
  append(out, log_time);
  append(out, log_time);  // publish_time: not known
  out += data;
  ++to.messages;
  ++messages_;
  chunk_.first = std::min(chunk_.first, log_time);
  chunk_.last = std::max(chunk_.last, log_time);
  first_ = std::min(first_, log_time);
  last_ = std::max(last_, log_time);
  if (out.size() >= chunk_bytes) close_chunk();
}

void McapWriter::close_chunk() {
  if (chunk_.records.empty()) return;
  compressed_.resize(ZSTD_compressBound(chunk_.records.size()));
  const std::size_t size =
      ZSTD_compress(compressed_.data(), compressed_.size(), chunk_.records.data(),
                    chunk_.records.size(), compression_level);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(ZSTD_getErrorName(size));
  compressed_.resize(size);

  const std::uint64_t begin = at_;
  std::string content;
  append(content, chunk_.first);
  append(content, chunk_.last);
  append(content, static_cast<std::uint64_t>(chunk_.records.size()));
  append(content, crc_of(0, chunk_.records));
  append_text(content, "zstd");
  append(content, static_cast<std::uint64_t>(compressed_.size()));
  content += compressed_;
  put(record(Opcode::chunk, content));
  const std::uint64_t end = at_;

  std::string offsets;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].index.empty()) continue;
    const auto id = static_cast<std::uint16_t>(i + 1);
    append(offsets, id);
    append(offsets, at_);
    std::string index;
    append(index, id);
    append_bytes(index, channels_[i].index);
    put(record(Opcode::message_index, index));
    channels_[i].index.clear();
  }

  std::string entry;
  append(entry, chunk_.first);
  append(entry, chunk_.last);
  append(entry, begin);
  append(entry, end - begin);
  append_bytes(entry, offsets);
  append(entry, at_ - end);
  append_text(entry, "zstd");
  append(entry, static_cast<std::uint64_t>(compressed_.size()));
  append(entry, static_cast<std::uint64_t>(chunk_.records.size()));
  chunk_indexes_.push_back(record(Opcode::chunk_index, entry));
  chunk_.records.clear();
  chunk_.first = UINT64_MAX;
  chunk_.last = 0;
}

std::string McapWriter::statistics() const {
  std::string content;
  append(content, messages_);
  append(content, static_cast<std::uint16_t>(schemas_.size()));
  append(content, static_cast<std::uint32_t>(channels_.size()));
  append(content, std::uint32_t{0});  // attachments
  append(content, std::uint32_t{0});  // metadata
  append(content, static_cast<std::uint32_t>(chunk_indexes_.size()));
  append(content, messages_ == 0 ? Nanoseconds{0} : first_);
  append(content, last_);
  std::string counts;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    append(counts, static_cast<std::uint16_t>(i + 1));
    append(counts, channels_[i].messages);
  }
  append_bytes(content, counts);
  return record(Opcode::statistics_record, content);
}

void McapWriter::close() {
  close_chunk();
  std::string end;
  append(end, crc_);
  put(record(Opcode::data_end, end));

  const std::uint64_t summary_start = at_;
  crc_ = 0;  // from here on of the summary
  std::string offsets;
  const auto group = [&](Opcode opcode, const std::vector<std::string>& records) {
    if (records.empty()) return;
    const std::uint64_t start = at_;
    for (const std::string& r : records) put(r);
    std::string content(1, static_cast<char>(opcode));
    append(content, start);
    append(content, at_ - start);
    offsets += record(Opcode::summary_offset, content);
  };
  std::vector<std::string> channels;
  for (const Channel& c : channels_) channels.push_back(c.record);
  group(Opcode::schema, schemas_);
  group(Opcode::channel, channels);
  group(Opcode::statistics_record, {statistics()});
  group(Opcode::chunk_index, chunk_indexes_);
  const std::uint64_t summary_offset_start = at_;
  put(offsets);

  std::string content;
  append(content, summary_start);
  append(content, summary_offset_start);
  std::string foot(1, static_cast<char>(Opcode::footer));
  append(foot, std::uint64_t{20});
  foot += content;
  put(foot);
  std::string crc;
  append(crc, crc_);
  put(crc);
  put(magic);
  file_.close();
}

}  // namespace berth::logs
