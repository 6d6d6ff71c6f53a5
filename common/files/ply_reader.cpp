// SPDX-License-Identifier: BSD-3-Clause
#include "common/files/ply_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace berth::files {
namespace {

/// Calls f with a value of the C++ type that a PLY type is.
template <class F>
auto with_type(PlyType type, F f) {
  switch (type) {
    case PlyType::int8:
      return f(std::int8_t{});
    case PlyType::uint8:
      return f(std::uint8_t{});
    case PlyType::int16:
      return f(std::int16_t{});
    case PlyType::uint16:
      return f(std::uint16_t{});
    case PlyType::int32:
      return f(std::int32_t{});
    case PlyType::uint32:
      return f(std::uint32_t{});
    case PlyType::int64:
      return f(std::int64_t{});
    case PlyType::uint64:
      return f(std::uint64_t{});
    case PlyType::float32:
      return f(float{});
    default:
      return f(double{});
  }
}

std::size_t size_of(PlyType type) {
  return with_type(type, [](auto value) { return sizeof value; });
}

bool is_whole(PlyType type) { return type != PlyType::float32 && type != PlyType::float64; }

bool type_named(std::string_view name, PlyType& type) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 18> names = {{
      {"char", PlyType::int8},
      {"int8", PlyType::int8},
      {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},
      {"short", PlyType::int16},
      {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},
      {"uint16", PlyType::uint16},
      {"int", PlyType::int32},
      {"int32", PlyType::int32},
      {"uint", PlyType::uint32},
      {"uint32", PlyType::uint32},
      {"int64", PlyType::int64},
      {"uint64", PlyType::uint64},
      {"float", PlyType::float32},
      {"float32", PlyType::float32},
      {"double", PlyType::float64},
      {"float64", PlyType::float64},
  }};
  const auto* const found =
      std::find_if(names.begin(), names.end(), [name](const auto& n) { return n.first == name; });
  if (found == names.end()) return false;
  type = found->second;
  return true;
}

template <class Type>
double decoded(const char* from, bool swapped) {
  std::array<char, sizeof(Type)> raw;
  std::memcpy(raw.data(), from, sizeof(Type));
  if (swapped) std::reverse(raw.begin(), raw.end());
  Type value;
  std::memcpy(&value, raw.data(), sizeof(Type));
  return static_cast<double>(value);
}

bool fits(PlyType type, double value) {
  return with_type(type, [value](auto example) {
    using Limits = std::numeric_limits<decltype(example)>;
    return value == std::trunc(value) && value >= static_cast<double>(Limits::lowest()) &&
           value <= static_cast<double>(Limits::max());
  });
}

bool is_comment(const Lines& line) {
  return line.words()[0] == "comment" || line.words()[0] == "obj_info";
}

/// Offset of what follows the header, whose lines all end as the first one does: in a binary file
/// the data may begin with any byte.
std::size_t end_of_header(std::string_view bytes) {
  const std::size_t first_end = bytes.find_first_of("\r\n");
  if (first_end == std::string_view::npos) return std::string_view::npos;
  const bool carriage_return = bytes[first_end] == '\r' && bytes.substr(first_end + 1, 1) != "\n";
  const char end = carriage_return ? '\r' : '\n';
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::size_t line_end = bytes.find(end, at);
    std::string_view line = bytes.substr(at, line_end - at);
    at = line_end == std::string_view::npos ? bytes.size() : line_end + 1;
    while (!line.empty() && (line.back() == ' ' || line.back() == '\t' || line.back() == '\r')) {
      line.remove_suffix(1);
    }
    if (line == "end_header") return at;
  }
  return std::string_view::npos;
}

}  // namespace

int PlyElement::find(std::string_view property) const {
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [property](const PlyProperty& p) { return p.name == property; });
  return found == properties.end() ? -1 : static_cast<int>(found - properties.begin());
}

PlyReader::PlyReader(std::string_view bytes, std::string file)
    : bytes_(bytes), file_(std::move(file)) {
  read_header(bytes);

  // Bounds the memory that a reader allocates for an element's rows by the size of the file.
  std::size_t left = bytes_.size() - at_;
  if (format_ == Format::text) ++left;  // the last line may have no end
  for (const PlyElement& element : elements_) {
    std::size_t min_bytes = 0;  // bytes of a row
    for (const PlyProperty& property : element.properties) {
      min_bytes += format_ == Format::text
                       ? 2
                       : size_of(property.is_list ? property.count_type : property.type);
    }
    if (min_bytes == 0) continue;
    if (element.count > left / min_bytes) {
      throw InputError(file_ + ": cut short: " + std::to_string(element.count) + " rows of '" +
                       element.name + "' declared, of at least " + std::to_string(min_bytes) +
                       " bytes each; " + std::to_string(left) + " bytes there");
    }
    left -= element.count * min_bytes;
  }
}

const PlyElement* PlyReader::find(std::string_view element) const {
  const auto found = std::find_if(elements_.begin(), elements_.end(),
                                  [element](const PlyElement& e) { return e.name == element; });
  return found == elements_.end() ? nullptr : &*found;
}

void PlyReader::read_header(std::string_view bytes) {
  at_ = end_of_header(bytes);
  const bool ended = at_ != std::string_view::npos;
  if (!ended) at_ = bytes.size();
  Lines lines(bytes.substr(0, at_), file_);
  if (!lines.next() || lines.words() != std::vector<std::string_view>{"ply"}) {
    throw lines.error("expected 'ply': no PLY file");
  }
  if (!ended) throw InputError(file_ + ": the header has no line 'end_header'");
  bool more = lines.next();
  for (; more && is_comment(lines); more = lines.next()) declare(lines);
  const auto& words = lines.words();
  if (!more || words.size() != 3 || words[0] != "format" || words[2] != "1.0" ||
      (words[1] != "ascii" && words[1] != "binary_little_endian" &&
       words[1] != "binary_big_endian")) {
    throw lines.error("found " + files::quoted(lines.rest(0)) +
                      ", expected 'format ascii 1.0', binary_little_endian or binary_big_endian");
  }
  format_ = words[1] == "ascii"                  ? Format::text
            : words[1] == "binary_little_endian" ? Format::little_endian
                                                 : Format::big_endian;
  while (lines.next()) declare(lines);
  if (format_ == Format::text) lines_ = Lines(bytes.substr(at_), file_, lines.number() + 1);
}

void PlyReader::declare(const Lines& line) {
  const auto& words = line.words();
  if (words[0] == "end_header") return;
  if (is_comment(line)) {
    comments_.emplace_back(line.rest(1));
    return;
  }
  if (words[0] == "element") {
    std::int64_t count = 0;
    if (words.size() != 3 || !parse_whole(words[2], count) || count < 0) {
      throw line.error("found " + files::quoted(line.rest(0)) + ", expected 'element NAME COUNT'");
    }
    if (find(words[1]) != nullptr) {
      throw line.error("a second element " + files::quoted(words[1]));
    }
    elements_.push_back({std::string(words[1]), static_cast<std::size_t>(count), {}});
    return;
  }
  if (words[0] != "property") {
    throw line.error("found " + files::quoted(words[0]) +
                     ", expected element, property, comment, obj_info or end_header");
  }
  if (elements_.empty()) throw line.error("a property before any element");
  PlyProperty property;
  property.is_list = words.size() == 5 && words[1] == "list";
  bool good = property.is_list
                  ? type_named(words[2], property.count_type) && is_whole(property.count_type)
                  : words.size() == 3;
  good = good && type_named(words[words.size() - 2], property.type);
  if (!good) {
    throw line.error(
        "found " + files::quoted(line.rest(0)) +
        ", expected 'property TYPE NAME' or 'property list WHOLE_TYPE TYPE NAME', with "
        "types char, uchar, short, ushort, int, uint, float, double, or int8 to "
        "float64");
  }
  property.name = words.back();
  PlyElement& element = elements_.back();
  if (element.find(property.name) >= 0) {
    throw line.error("a second property " + files::quoted(property.name) + " of element " +
                     files::quoted(element.name));
  }
  element.properties.push_back(property);
}

bool PlyReader::next() {
  if (begun_) ++row_;
  begun_ = true;
  while (element_ < elements_.size() && (row_ >= element().count || element().properties.empty())) {
    ++element_;
    row_ = 0;
  }
  const bool more = element_ < elements_.size();
  row_at_ = at_;
  if (format_ == Format::text) {
    if (lines_.next() != more) {
      if (more) cut_short();
      throw lines_.error("found " + files::quoted(lines_.rest(0)) +
                         ", expected the end: all rows that the header declares were read");
    }
    if (more) find_text_row();
  } else if (more) {
    find_binary_row();
  } else if (at_ != bytes_.size()) {
    throw error(std::to_string(bytes_.size() - at_) +
                " bytes follow all rows that the header declares");
  }
  return more;
}

void PlyReader::find_text_row() {
  const auto& words = lines_.words();
  std::size_t at = 0;
  places_.clear();
  for (const PlyProperty& property : element().properties) {
    Place place{at, 1};
    if (property.is_list && at < words.size()) {
      place.count = list_length(property, value_at(property, property.count_type, place, 0));
      place.first = ++at;
    }
    if (place.count > words.size() - std::min(at, words.size())) {
      throw error("found " + std::to_string(words.size()) + " values, too few for '" +
                  property.name + "'");
    }
    places_.push_back(place);
    at += place.count;
  }
  if (at != words.size()) {
    throw error("found " + std::to_string(words.size()) + " values, expected " +
                std::to_string(at));
  }
}

void PlyReader::find_binary_row() {
  places_.clear();
  for (const PlyProperty& property : element().properties) {
    Place place{at_, 1};
    if (property.is_list) {
      const std::size_t size = size_of(property.count_type);
      if (size > bytes_.size() - at_) cut_short();
      place.count = list_length(property, value_at(property, property.count_type, place, 0));
      place.first = at_ += size;
    }
    const std::size_t size = size_of(property.type);
    if (place.count > (bytes_.size() - at_) / size) cut_short();
    places_.push_back(place);
    at_ += place.count * size;
  }
}

std::size_t PlyReader::list_length(const PlyProperty& property, double length) const {
  if (!(length >= 0)) {
    throw error("found " + std::to_string(static_cast<std::int64_t>(length)) +
                " for the length of list '" + property.name + "'");
  }
  return static_cast<std::size_t>(std::min(length, static_cast<double>(bytes_.size())));
}

double PlyReader::value_at(const PlyProperty& property, PlyType type, const Place& place,
                           std::size_t i) const {
  if (format_ != Format::text) {
    const char* const from = bytes_.data() + place.first + i * size_of(type);
    return with_type(type, [&](auto example) {
      return decoded<decltype(example)>(from, format_ == Format::big_endian);
    });
  }
  const std::string_view word = lines_.words()[place.first + i];
  double value = 0;
  if (!parse_number(word, value) || (is_whole(type) && !fits(type, value))) {
    throw error("found " + files::quoted(word) + " for '" + property.name + "', expected " +
                (is_whole(type) ? "a whole number of the type declared" : "a number"));
  }
  return value;
}

const PlyProperty& PlyReader::declared(int property, bool as_list) const {
  const PlyProperty& found = element().properties[static_cast<std::size_t>(property)];
  if (found.is_list != as_list) {
    throw error("'" + found.name + "' is declared as " + (as_list ? "one value" : "a list") +
                ", expected " + (as_list ? "a list" : "one value"));
  }
  return found;
}

double PlyReader::value(int property) const {
  const PlyProperty& found = declared(property, false);
  return value_at(found, found.type, places_[static_cast<std::size_t>(property)], 0);
}

std::span<const double> PlyReader::list(int property) const {
  const PlyProperty& found = declared(property, true);
  const Place& place = places_[static_cast<std::size_t>(property)];
  list_.resize(place.count);
  for (std::size_t i = 0; i < list_.size(); ++i) {
    list_[i] = value_at(found, found.type, place, i);
  }
  return list_;
}

void PlyReader::cut_short() const {
  throw error("cut short: " + std::to_string(element().count) + " rows of '" + element().name +
              "' declared, " + std::to_string(row_) + " there");
}

InputError PlyReader::error(const std::string& what) const {
  const std::string row = element_ < elements_.size()
                              ? element().name + " " + std::to_string(row_) + ": "
                              : std::string();
  if (format_ == Format::text) return lines_.error(row + what);
  return InputError(file_ + ": byte " + std::to_string(row_at_) + ": " + row + what);
}

}  // namespace berth::files
