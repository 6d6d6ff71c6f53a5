// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <limits>

#include "common/files/lines.h"
#include "common/meshes/mesh_builder.h"
#include "common/meshes/mesh_file.h"

namespace berth {
namespace {

/// Statements that change no surface.
constexpr std::array passed_over = {
    "vt",     "vn",  "vp", "l",          "p",         "s",     "mtllib",   "usemap",
    "maplib", "lod", "mg", "shadow_obj", "trace_obj", "bevel", "c_interp", "d_interp"};

class ObjMesh {
 public:
  ObjMesh(std::string_view text, const std::string& file) : lines_(text, file), file_(file) {
    lines_.set_marks('\\', '#');
  }

  Mesh read() {
    while (lines_.next()) {
      const std::string_view keyword = lines_.words()[0];
      if (keyword == "v") {
        read_vertex();
      } else if (keyword == "f" || keyword == "fo") {
        read_face();
      } else if (keyword == "g") {
        groups_.assign(lines_.words().begin() + 1, lines_.words().end());
        name_groups();
      } else if (keyword == "o") {
        object_ = lines_.rest(1);
        name_groups();
      } else if (keyword == "usemtl") {
        material_ = lines_.rest(1);
        name_groups();
      } else if (std::find(passed_over.begin(), passed_over.end(), keyword) == passed_over.end()) {
        throw lines_.error("found " + files::quoted(keyword) +
                           ", expected a statement of a polygonal mesh: v, f, g, o, usemtl, ...");
      }
    }
    return builder_.take(file_);
  }

 private:
  /// x y z, then nothing, a weight, a colour, or both.
  void read_vertex() {
    const auto& words = lines_.words();
    std::array<double, 7> values{};
    const std::size_t count = words.size() - 1;
    bool good = count == 3 || count == 4 || count == 6 || count == 7;
    for (std::size_t i = 0; good && i < count; ++i) {
      good = files::parse_number(words[i + 1], values[i]);
    }
    if (!good) throw expected("'v X Y Z'");
    if (count % 3 == 1 && values[3] != 1) throw expected("a weight of 1");
    refuse(builder_.add_vertex({values[0], values[1], values[2]}));
  }

  void read_face() {
    const auto& words = lines_.words();
    corners_.clear();
    for (std::size_t i = 1; i < words.size(); ++i) corners_.push_back(corner(words[i]));
    refuse(builder_.add_face(corners_));
  }

  /// The vertex of v, v/vt, v//vn or v/vt/vn. Indices of texture and normal must be numbers.
  std::uint32_t corner(std::string_view word) const {
    std::array<std::int64_t, 3> index{};
    std::string_view left = word;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t end = std::min(left.find('/'), left.size());
      const bool empty = end == 0 && i > 0;
      if (!empty && (!files::parse_whole(left.substr(0, end), index[i]) || index[i] == 0)) break;
      if (end == left.size()) return vertex(index[0]);
      left.remove_prefix(end + 1);
    }
    throw lines_.error("found " + files::quoted(word) +
                       ", expected V, V/VT, V//VN or V/VT/VN, numbers from 1, or from -1 down");
  }

  std::uint32_t vertex(std::int64_t index) const {
    const auto count = static_cast<std::int64_t>(builder_.vertex_count());
    if (index > count || index < -count) {
      throw lines_.error("vertex " + std::to_string(index) +
                         " does not exist: " + std::to_string(count) + " are defined so far");
    }
    return static_cast<std::uint32_t>(index > 0 ? index - 1 : count + index);
  }

  void name_groups() {
    std::vector<std::string> names = groups_;
    for (const std::string& name : {object_, material_}) {
      if (!name.empty()) names.push_back(name);
    }
    builder_.set_groups(names);
  }

  void refuse(const std::string& why) const {
    if (!why.empty()) throw lines_.error(why);
  }

  InputError expected(const std::string& what) const {
    return lines_.error("found " + files::quoted(lines_.rest(0)) + ", expected " + what);
  }

  files::Lines lines_;
  const std::string& file_;
  MeshBuilder builder_;
  std::vector<std::string> groups_;
  std::string object_;
  std::string material_;
  std::vector<std::uint32_t> corners_;
};

}  // namespace

Mesh parse_obj_mesh(std::string_view bytes, const std::string& file) {
  return ObjMesh(bytes, file).read();
}

}  // namespace berth
