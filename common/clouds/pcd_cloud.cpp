// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>

#include "common/clouds/cloud_builder.h"
#include "common/clouds/cloud_formats.h"
#include "common/clouds/text_lines.h"
#include "common/clouds/text_table.h"
#include "common/core/error.h"
#include "common/files/lines.h"

namespace berth::clouds {

namespace {

enum class Data { text, binary, compressed };

constexpr std::size_t max_points = std::numeric_limits<std::uint32_t>::max();

struct Field {
  std::string name;
  char type = 'F';
  std::size_t size = 4;
  std::size_t count = 1;
  std::size_t offset = 0;  ///< in a row, bytes

  std::size_t bytes() const { return size * count; }
};

struct Header {
  std::vector<Field> fields;
  std::size_t width = 0;
  std::size_t height = 1;
  std::size_t points = 0;
  std::size_t row_bytes = 0;
  bool has_viewpoint = false;  ///< other than the sensor's own
  Data data = Data::text;
  std::size_t lines = 0;   ///< of the header
  std::size_t offset = 0;  ///< of what follows it

  std::size_t values() const {  ///< of a row
    return std::accumulate(fields.begin(), fields.end(), std::size_t{0},
                           [](std::size_t sum, const Field& field) { return sum + field.count; });
  }
};

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, const std::string& file)
      : file_(file), lines_(header_of(bytes), file) {}

  Header header() {
    bool ended = false;
    while (!ended && lines_.next()) ended = take(lines_.words());
    if (!ended) {
      throw InputError(file_ + ": found no line DATA in the header, expected a PCD file");
    }
    if (header_.fields.empty()) throw InputError(file_ + ": found no FIELDS in the header");
    for (Field& field : header_.fields) {
      field.offset = header_.row_bytes;
      header_.row_bytes += field.bytes();
    }
    if (!has_width_) header_.width = header_.points;
    if (!has_points_) header_.points = header_.width * header_.height;
    if (header_.points != header_.width * header_.height) {
      throw InputError(file_ + ": found " + std::to_string(header_.points) + " POINTS, expected " +
                       std::to_string(header_.width) + " x " + std::to_string(header_.height) +
                       " of WIDTH and HEIGHT");
    }
    if (header_.points == 0) throw InputError(file_ + ": holds no point");
    if (header_.points > max_points) throw InputError(file_ + ": found too many points");
    header_.lines = lines_.number();
    header_.offset = lines_.offset();
    return header_;
  }

 private:
  /// Up to the line DATA and its end: what follows may be anything.
  static std::string_view header_of(std::string_view bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t end = bytes.find_first_of("\r\n", at);
      if (end == std::string_view::npos) break;
      const bool is_data = bytes.substr(at, 5) == "DATA ";
      at = end + (bytes.substr(end, 2) == "\r\n" ? 2 : 1);
      if (is_data) return bytes.substr(0, at);
    }
    return bytes.substr(0, 0);
  }

  /// @return whether the header ends.
  bool take(const std::vector<std::string_view>& words) {
    const std::string_view key = words[0];
    const std::size_t values = words.size() - 1;
    if (key[0] == '#' || key == "VERSION") return false;
    if (key == "FIELDS" || key == "COLUMNS") {
      if (!header_.fields.empty()) throw lines_.error("found FIELDS twice");
      if (values == 0) throw lines_.error("found no field, expected x, y and z");
      for (std::size_t i = 0; i < values; ++i) {
        header_.fields.emplace_back().name = words[i + 1];
      }
    } else if (key == "SIZE" || key == "TYPE" || key == "COUNT") {
      if (values != header_.fields.size()) {
        throw lines_.error("found " + std::to_string(values) + " values of " + std::string(key) +
                           ", expected one for each of the " +
                           std::to_string(header_.fields.size()) + " FIELDS");
      }
      for (std::size_t i = 0; i < values; ++i) describe(header_.fields[i], key, words[i + 1]);
    } else if (key == "WIDTH" || key == "HEIGHT" || key == "POINTS") {
      const std::size_t number =
          values == 1 ? whole(words[1], 0, max_points) : throw expected_one(key);
      (key == "WIDTH" ? header_.width : key == "HEIGHT" ? header_.height : header_.points) = number;
      has_width_ = has_width_ || key == "WIDTH";
      has_points_ = has_points_ || key == "POINTS";
    } else if (key == "VIEWPOINT") {
      constexpr std::array<double, 7> own = {0, 0, 0, 1, 0, 0, 0};
      for (std::size_t i = 0; i < std::min(values, own.size()); ++i) {
        double value = 0;
        header_.has_viewpoint =
            header_.has_viewpoint || !files::parse_number(words[i + 1], value) || value != own[i];
      }
    } else if (key == "DATA") {
      const std::string_view data = values == 1 ? words[1] : throw expected_one(key);
      if (data != "ascii" && data != "binary" && data != "binary_compressed") {
        throw lines_.error("found DATA " + files::quoted(data) +
                           ", expected ascii, binary or binary_compressed");
      }
      header_.data = data == "ascii"    ? Data::text
                     : data == "binary" ? Data::binary
                                        : Data::compressed;
      return true;
    } else {
      throw lines_.error("found " + files::quoted(key) + ", expected a line of a PCD header");
    }
    return false;
  }

  void describe(Field& field, std::string_view key, std::string_view word) {
    constexpr std::size_t max_count = 1'000'000;  // features of a point have some hundreds
    if (key == "SIZE") field.size = whole(word, 1, 8);
    if (key == "COUNT") field.count = whole(word, 1, max_count);
    if (key == "TYPE") {
      if (word != "F" && word != "I" && word != "U") {
        throw lines_.error("found TYPE " + files::quoted(word) + ", expected F, I or U");
      }
      field.type = word[0];
    }
  }

  std::size_t whole(std::string_view word, std::size_t min_value, std::size_t max_value) const {
    std::int64_t number = 0;
    if (!files::parse_whole(word, number) || number < static_cast<std::int64_t>(min_value) ||
        number > static_cast<std::int64_t>(max_value)) {
      throw lines_.error("found " + files::quoted(word) + ", expected a whole number from " +
                         std::to_string(min_value) + " to " + std::to_string(max_value));
    }
    return static_cast<std::size_t>(number);
  }

  InputError expected_one(std::string_view key) const {
    return lines_.error("expected one value of " + std::string(key));
  }

  const std::string& file_;
  files::Lines lines_;
  Header header_;
  bool has_width_ = false;
  bool has_points_ = false;
};

template <class T>
double as(const char* bytes) {
  T number;
  std::memcpy(&number, bytes, sizeof number);
  return static_cast<double>(number);
}

double (*decoder(const Field& field, const std::string& file))(const char*) {
  switch (field.type == 'F' ? 0 : field.type == 'I' ? 1 : 2) {
    case 0:
      if (field.size == 4) return as<float>;
      if (field.size == 8) return as<double>;
      break;
    case 1:
      if (field.size == 1) return as<std::int8_t>;
      if (field.size == 2) return as<std::int16_t>;
      if (field.size == 4) return as<std::int32_t>;
      if (field.size == 8) return as<std::int64_t>;
      break;
    default:
      if (field.size == 1) return as<std::uint8_t>;
      if (field.size == 2) return as<std::uint16_t>;
      if (field.size == 4) return as<std::uint32_t>;
      if (field.size == 8) return as<std::uint64_t>;
  }
  throw InputError(file + ": found TYPE " + field.type + " of SIZE " + std::to_string(field.size) +
                   " for field '" + field.name + "', expected F of 4 or 8 or I, U of 1, 2, 4 or 8");
}

/// LZF (Lehmann 2000): runs of literals, and repetitions of what is at most 8 KiB back.
/// @return whether the bytes decompress to exactly the size of out.
bool decompress_lzf(std::string_view in, std::string& out) {
  std::size_t at = 0;
  std::size_t filled = 0;
  const auto next = [&] { return static_cast<std::size_t>(static_cast<unsigned char>(in[at++])); };
  while (at < in.size()) {
    const std::size_t control = next();
    if (control < 32) {
      const std::size_t length = control + 1;
      if (length > in.size() - at || length > out.size() - filled) return false;
      std::memcpy(out.data() + filled, in.data() + at, length);
      at += length;
      filled += length;
      continue;
    }
    std::size_t length = control / 32 + 2;
    if (length == 9) {
      if (at == in.size()) return false;
      length += next();
    }
    if (at == in.size()) return false;
    const std::size_t back = control % 32 * 256 + next() + 1;
    if (back > filled || length > out.size() - filled) return false;
    for (; length > 0; --length, ++filled) out[filled] = out[filled - back];
  }
  return filled == out.size();
}

/// The rows of a binary file, checked against what is declared. rows: room for what is
/// decompressed.
class BinaryRows {
 public:
  BinaryRows(const Header& header, std::string_view data, const std::string& file)
      : header_(header) {
    const std::size_t declared = header.points * header.row_bytes;
    const auto refuse = [&](const std::string& what) {
      throw InputError(file + ": " + what + ", expected " + std::to_string(header.points) +
                       " points of " + std::to_string(header.row_bytes) + " bytes");
    };
    if (header.row_bytes > std::numeric_limits<std::uint32_t>::max()) refuse("found long rows");
    if (header.data == Data::compressed) {
      std::array<std::uint32_t, 2> sizes{};  // compressed, and not
      if (data.size() < sizeof sizes) refuse("found a file cut short");
      std::memcpy(sizes.data(), data.data(), sizeof sizes);
      data.remove_prefix(sizeof sizes);
      if (sizes[0] > data.size()) refuse("found a file cut short");
      constexpr std::size_t max_compression = 100;  // of LZF: 264 bytes in 3
      if (sizes[1] != declared || declared / max_compression > sizes[0]) {
        refuse("found " + std::to_string(sizes[1]) + " bytes compressed in " +
               std::to_string(sizes[0]));
      }
      decompressed_.resize(declared);
      if (!decompress_lzf(data.substr(0, sizes[0]), decompressed_)) refuse("found damaged data");
      bytes_ = decompressed_;
      data.remove_prefix(sizes[0]);
    } else {
      if (data.size() < declared) refuse("found a file cut short");
      bytes_ = data.substr(0, declared);
      data.remove_prefix(declared);
    }
    // some writers fill the last page, or end a line
    constexpr std::string_view padding("\0\r\n", 3);
    if (data.find_first_not_of(padding) != std::string_view::npos) {
      refuse("found " + std::to_string(data.size()) + " bytes more");
    }
  }

  /// Compressed data hold the first field of all points, then the second, and so on.
  const char* at(std::size_t row, const Field& field) const {
    const std::size_t offset = header_.data == Data::compressed
                                   ? header_.points * field.offset + row * field.bytes()
                                   : row * header_.row_bytes + field.offset;
    return bytes_.data() + offset;
  }

 private:
  const Header& header_;
  std::string decompressed_;
  std::string_view bytes_;
};

/// One cell per value. An array has several cells and is no coordinate, time or sigma.
Table text_table(const Header& header, std::string_view data, const std::string& file) {
  if (header.values() > data.size()) {
    throw InputError(file + ": found a file cut short, expected " +
                     std::to_string(header.values()) + " values a point");
  }
  DeclaredTable declared{{}, header.points, header.lines};
  for (const Field& field : header.fields) {
    declared.names.push_back(field.count == 1 ? field.name : "");
    declared.names.resize(declared.names.size() + field.count - 1);
  }
  return read_text_table(text_of(std::string(data), file), file, &declared);
}

Table binary_table(const Header& header, std::string_view data, const std::string& file) {
  std::vector<std::string> names;
  for (const Field& field : header.fields) names.push_back(field.count == 1 ? field.name : "");
  Table table;
  table.columns = find_columns(names, file);
  if (!table.columns.has_point()) {
    throw InputError(file + ": found no fields x, y and z of COUNT 1 in the header");
  }
  const BinaryRows rows(header, data, file);
  table.rows.resize(header.points);
  const auto take = [&](const Column& column, auto&& set) {
    if (!column) return;
    const Field& field = header.fields[static_cast<std::size_t>(column.index)];
    const auto decode = decoder(field, file);
    for (std::size_t i = 0; i < header.points; ++i) set(table.rows[i], decode(rows.at(i, field)));
  };
  take(table.columns.x, [](CloudRow& row, double value) { row.point.x() = value; });
  take(table.columns.y, [](CloudRow& row, double value) { row.point.y() = value; });
  take(table.columns.z, [](CloudRow& row, double value) { row.point.z() = value; });
  take(table.columns.sigma, [](CloudRow& row, double value) { row.sigma = value; });
  take(table.columns.return_number, [](CloudRow& row, double value) { row.return_number = value; });
  take(table.columns.time, [](CloudRow& row, double value) { row.time = value; });
  return table;
}

}  // namespace

Cloud parse_pcd(std::string_view bytes, const std::string& file, const CloudOptions& options) {
  const Header header = HeaderReader(bytes, file).header();
  const std::string_view data = bytes.substr(header.offset);
  const Table table =
      header.data == Data::text ? text_table(header, data, file) : binary_table(header, data, file);
  CloudBuilder cloud(table.columns, options);
  for (const CloudRow& row : table.rows) cloud.add(row);
  if (header.height > 1) cloud.take_not_finite_as_empty();
  if (header.has_viewpoint) {
    cloud.note("the file's viewpoint is not used: points are taken as they stand");
  }
  return cloud.finish();
}

}  // namespace berth::clouds
