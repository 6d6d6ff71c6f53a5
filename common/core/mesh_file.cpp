// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <map>

#include "common/core/error.h"
#include "common/core/mesh.h"

namespace berth {
namespace {

/// Gives every place one index: file readers repeat the vertices of each face.
class Welder {
 public:
  explicit Welder(Mesh& mesh) : mesh_(mesh) {}
  std::uint32_t index(const Vector3d& v) {
    const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
    const auto [place, fresh] = index_.try_emplace({v.x(), v.y(), v.z()}, next);
    if (fresh) mesh_.vertices.push_back(v);
    return place->second;
  }

 private:
  Mesh& mesh_;
  std::map<std::array<double, 3>, std::uint32_t> index_;
};

bool degenerate(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double edge =
      std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
  return (b - a).cross(c - a).norm() <= 1e-9 * edge;
}

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Vector3d vertex(const aiMesh& part, unsigned index) {
  const aiVector3D& v = part.mVertices[index];
  return {double{v.x}, double{v.y}, double{v.z}};
}

}  // namespace

Mesh load_mesh(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (extension != ".ply" && extension != ".stl" && extension != ".obj") {
    throw InputError(path.string() + ": found '" + extension +
                     "', expected a .ply, .stl or .obj mesh");
  }
  if (!std::filesystem::is_regular_file(path)) throw InputError(path.string() + ": no such file");

  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
  if (scene == nullptr) {
    throw InputError(path.string() + ": cannot be read: " + importer.GetErrorString());
  }
  Mesh mesh;
  Welder welder(mesh);
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      if (!vertex(part, i).allFinite()) {
        throw InputError(path.string() + ": a coordinate is not finite");
      }
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      Vector3d corner[3];
      for (unsigned i = 0; i < 3; ++i) {
        if (face.mIndices[i] >= part.mNumVertices) {
          throw InputError(path.string() + ": a face names a vertex that is not there");
        }
        corner[i] = vertex(part, face.mIndices[i]);
      }
      if (degenerate(corner[0], corner[1], corner[2])) continue;
      mesh.triangles.push_back(
          {welder.index(corner[0]), welder.index(corner[1]), welder.index(corner[2])});
    }
  }
  if (mesh.triangles.empty()) throw InputError(path.string() + ": holds no triangle");
  return mesh;
}

}  // namespace berth
