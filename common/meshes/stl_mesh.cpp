// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <cstring>

#include "common/files/lines.h"
#include "common/meshes/mesh_builder.h"
#include "common/meshes/mesh_file.h"

namespace berth {
namespace {

constexpr std::size_t header_size = 80;
constexpr std::size_t facet_size = 50;  // normal, three corners, attribute

/// Adds the vertex and its number to the corners.
void add_corner(MeshBuilder& builder, const Vector3d& vertex, std::vector<std::uint32_t>& corners,
                const auto& error) {
  corners.push_back(static_cast<std::uint32_t>(builder.vertex_count()));
  if (const std::string why = builder.add_vertex(vertex); !why.empty()) throw error(why);
}

class StlText {
 public:
  StlText(std::string_view text, const std::string& file) : lines_(text, file), file_(file) {}

  Mesh read() {
    while (lines_.next()) {
      if (!is("solid")) throw expected("'solid'");
      builder_.set_groups(lines_.words().size() > 1
                              ? std::vector<std::string>{std::string(lines_.rest(1))}
                              : std::vector<std::string>{});
      for (go_on(); !is("endsolid"); go_on()) read_facet();
    }
    return builder_.take(file_);
  }

 private:
  void read_facet() {
    if (!is("facet")) throw expected("'facet' or 'endsolid'");
    go_on();
    if (!is("outer", "loop")) throw expected("'outer loop'");
    std::vector<std::uint32_t>& corners = corners_;
    corners.clear();
    for (int i = 0; i < 3; ++i) {
      go_on();
      const auto& words = lines_.words();
      Vector3d vertex;
      if (words.size() != 4 || !is("vertex") || !files::parse_number(words[1], vertex.x()) ||
          !files::parse_number(words[2], vertex.y()) ||
          !files::parse_number(words[3], vertex.z())) {
        throw expected("'vertex X Y Z'");
      }
      add_corner(builder_, vertex, corners,
                 [this](const std::string& why) { return lines_.error(why); });
    }
    go_on();
    if (!is("endloop")) throw expected("'endloop'");
    go_on();
    if (!is("endfacet")) throw expected("'endfacet'");
    builder_.add_face(corners);
  }

  bool is(std::string_view first, std::string_view second = {}) const {
    const auto same = [](std::string_view word, std::string_view keyword) {
      return std::equal(word.begin(), word.end(), keyword.begin(), keyword.end(),
                        [](unsigned char a, char b) { return std::tolower(a) == b; });
    };
    const auto& words = lines_.words();
    return same(words[0], first) &&
           (second.empty() || (words.size() == 2 && same(words[1], second)));
  }

  void go_on() {
    if (!lines_.next()) throw lines_.error("cut short: the file ends before 'endsolid'");
  }

  InputError expected(const std::string& what) const {
    return lines_.error("found " + files::quoted(lines_.rest(0)) + ", expected " + what);
  }

  files::Lines lines_;
  const std::string& file_;
  MeshBuilder builder_;
  std::vector<std::uint32_t> corners_;
};

Mesh parse_binary(std::string_view bytes, std::size_t facets, const std::string& file) {
  MeshBuilder builder;
  std::vector<std::uint32_t> corners;
  for (std::size_t f = 0; f < facets; ++f) {
    const std::size_t at = header_size + 4 + f * facet_size;
    const auto error = [&](const std::string& why) {
      return InputError(file + ": byte " + std::to_string(at) + ": facet " + std::to_string(f) +
                        ": " + why);
    };
    std::array<float, 12> values;  // x86-64 only: little-endian
    std::memcpy(values.data(), bytes.data() + at, sizeof values);
    corners.clear();
    for (std::size_t i = 3; i < values.size(); i += 3) {
      add_corner(builder, Eigen::Vector3f(values[i], values[i + 1], values[i + 2]).cast<double>(),
                 corners, error);
    }
    builder.add_face(corners);
  }
  return builder.take(file);
}

}  // namespace

Mesh parse_stl_mesh(std::string_view bytes, const std::string& file) {
  std::uint32_t facets = 0;
  std::size_t expected = header_size + sizeof facets;
  const bool has_header = bytes.size() >= expected;
  if (has_header) std::memcpy(&facets, bytes.data() + header_size, sizeof facets);
  expected += facets * facet_size;
  // The header of a binary file may begin with "solid" too, but only a text has no byte of 0.
  if (has_header && bytes.size() == expected) return parse_binary(bytes, facets, file);
  if (bytes.find('\0') == std::string_view::npos) return StlText(bytes, file).read();
  throw InputError(file + ": " + std::to_string(facets) + " facets declared, which take " +
                   std::to_string(expected) + " bytes; found " + std::to_string(bytes.size()) +
                   " bytes");
}

}  // namespace berth
