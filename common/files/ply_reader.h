// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/files/lines.h"

namespace berth::files {

/// Scalar types of PLY; int8 is also called char, uint8 uchar, and so on.
enum class PlyType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;
  bool is_list = false;
  PlyType count_type = PlyType::uint8;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;  ///< as declared; the file is large enough to hold so many
  std::vector<PlyProperty> properties;

  /// Index of a property; -1: it has none of that name.
  int find(std::string_view property) const;
};

/// Goes through a PLY file (Turk, "The PLY polygon file format", 1994) row by row: text, little or
/// big endian; any scalar types; lists anywhere. In a text file a row is a line. A file that holds
/// less or more than its header declares is refused. Memory use does not grow with the file.
///
///     files::PlyReader ply(read_file(path), path.string());
///     const files::PlyElement* vertices = ply.find("vertex");
///     const int x = vertices->find("x");
///     while (ply.next()) {
///       if (&ply.element() == vertices) xs.push_back(ply.value(x));
///     }
class PlyReader {
 public:
  /// Reads the header. bytes must outlive this. @throws InputError naming file and line.
  PlyReader(std::string_view bytes, std::string file);

  const std::vector<PlyElement>& elements() const { return elements_; }
  /// nullptr: there is none of that name.
  const PlyElement* find(std::string_view element) const;
  /// Lines of the header that begin with "comment" or "obj_info", without that word.
  const std::vector<std::string>& comments() const { return comments_; }

  /// Goes to the next row, of the same element or of the next one. Properties that are not
  /// requested are passed over unread. @return false after the last. @throws InputError when the
  /// file is cut short or too long, or a list has no length.
  bool next();
  const PlyElement& element() const { return elements_[element_]; }
  /// Number of the present row in its element, from 0.
  std::size_t row() const { return row_; }

  /// A scalar of the present row; it may be NaN or infinite. Whole numbers are exact to 2^53.
  /// @throws InputError when it is declared as a list; in a text file also when it is no number, or
  /// not of the type declared.
  double value(int property) const;
  /// A list of the present row; valid until the next call of list or next.
  std::span<const double> list(int property) const;

  /// "file:line: element row: what" in a text file, "file: byte N: element row: what" in others.
  InputError error(const std::string& what) const;

 private:
  enum class Format { text, little_endian, big_endian };
  /// The values of a property of the present row: its first value, and how many there are.
  struct Place {
    std::size_t first = 0;  ///< index of the word in its line, or offset in the file's bytes
    std::size_t count = 1;
  };

  void read_header(std::string_view bytes);
  void declare(const Lines& line);
  void find_text_row();
  void find_binary_row();
  const PlyProperty& declared(int property, bool as_list) const;
  std::size_t list_length(const PlyProperty& property, double length) const;
  double value_at(const PlyProperty& property, PlyType type, const Place& place,
                  std::size_t i) const;
  [[noreturn]] void cut_short() const;

  std::string_view bytes_;
  std::string file_;
  Format format_ = Format::text;
  std::vector<PlyElement> elements_;
  std::vector<std::string> comments_;
  Lines lines_{{}, {}};  ///< of a text file's rows
  std::size_t at_ = 0;   ///< in bytes_: where the next row begins
  std::size_t row_at_ = 0;
  std::size_t element_ = 0;
  std::size_t row_ = 0;
  bool begun_ = false;
  std::vector<Place> places_;
  mutable std::vector<double> list_;
};

}  // namespace berth::files
