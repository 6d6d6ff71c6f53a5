// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "common/files/ply_reader.h"
#include "common/meshes/mesh_builder.h"
#include "common/meshes/mesh_file.h"

namespace berth {
namespace {

using files::PlyElement;
using files::PlyReader;

class PlyMesh {
 public:
  PlyMesh(std::string_view bytes, const std::string& file)
      : ply_(bytes, file),
        vertices_(ply_.find("vertex")),
        faces_(ply_.find("face")),
        strips_(ply_.find("tristrips")) {
    if (vertices_ == nullptr || (faces_ == nullptr && strips_ == nullptr)) {
      throw InputError(file + ": found elements " + names() +
                       ", expected 'vertex', and 'face' or 'tristrips'" +
                       (vertices_ == nullptr ? "" : ": a cloud of points is no mesh"));
    }
    const auto& comments = ply_.comments();
    if (std::find(comments.begin(), comments.end(), vertices_as_numbered) != comments.end()) {
      builder_.keep_numbering();
    }
    for (std::size_t i = 0; i < 3; ++i) {
      xyz_[i] = vertices_->find(std::string(1, "xyz"[i]));
      if (xyz_[i] < 0) throw InputError(file + ": its vertices have no " + "xyz"[i]);
    }
    for (const PlyElement* element : {faces_, strips_}) {
      if (element == nullptr) continue;
      if (element < vertices_) {
        throw InputError(file + ": element '" + element->name +
                         "' comes before 'vertex', expected after it");
      }
      if (indices_of(*element) < 0) {
        throw InputError(file + ": element '" + element->name +
                         "' has no list 'vertex_indices' or 'vertex_index'");
      }
    }
  }

  Mesh read(const std::string& file) {
    while (ply_.next()) {
      const PlyElement* const element = &ply_.element();
      if (element == vertices_) {
        refuse(
            builder_.add_vertex({ply_.value(xyz_[0]), ply_.value(xyz_[1]), ply_.value(xyz_[2])}));
      } else if (element == faces_) {
        corners_.clear();
        for (const double index : ply_.list(indices_of(*faces_))) add_corner(index);
        refuse(builder_.add_face(corners_));
      } else if (element == strips_) {
        read_strip();
      }
    }
    return builder_.take(file);
  }

 private:
  static int indices_of(const PlyElement& element) {
    const int plural = element.find("vertex_indices");
    return plural >= 0 ? plural : element.find("vertex_index");
  }

  std::string names() const {
    std::string text;
    for (const PlyElement& element : ply_.elements()) {
      text += (text.empty() ? "'" : ", '") + element.name + "'";
    }
    return text.empty() ? "none" : text;
  }

  void refuse(const std::string& why) const {
    if (!why.empty()) throw ply_.error(why);
  }

  void add_corner(double index) {
    const auto count = static_cast<double>(builder_.vertex_count());
    if (!(index >= 0 && index < count && index == std::trunc(index))) {
      throw ply_.error("vertex " + fixed(index, 0) + " of " +
                       std::to_string(builder_.vertex_count()) + " does not exist");
    }
    corners_.push_back(static_cast<std::uint32_t>(index));
  }

  /// Each corner makes a triangle with the two before it, of alternating winding; -1 starts anew.
  void read_strip() {
    corners_.clear();
    for (const double index : ply_.list(indices_of(*strips_))) {
      if (index == -1) {
        end_strip();
      } else {
        add_corner(index);
      }
    }
    end_strip();
  }

  void end_strip() {
    for (std::size_t i = 0; i + 2 < corners_.size(); ++i) {
      const std::uint32_t a = corners_[i + i % 2];
      const std::uint32_t b = corners_[i + 1 - i % 2];
      const std::uint32_t c = corners_[i + 2];
      if (a == b || b == c || c == a) continue;  // how strips turn corners
      refuse(builder_.add_face(std::array{a, b, c}));
    }
    if (corners_.size() == 1 || corners_.size() == 2) refuse(builder_.add_face(corners_));
    corners_.clear();
  }

  PlyReader ply_;
  const PlyElement* vertices_;
  const PlyElement* faces_;
  const PlyElement* strips_;
  std::array<int, 3> xyz_{};
  std::vector<std::uint32_t> corners_;
  MeshBuilder builder_;
};

}  // namespace

Mesh parse_ply_mesh(std::string_view bytes, const std::string& file) {
  return PlyMesh(bytes, file).read(file);
}

}  // namespace berth
