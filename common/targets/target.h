// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/mesh.h"

namespace berth {

/// How a surface reflects light: a diffuse part (Lambert) and one as by small mirrors, whose slopes
/// about the surface are normally distributed. Paint: no mirrors; glass: smooth; foil: crinkled.
struct Material {
  double reflectivity = 0.5;         ///< diffuse, 0..1
  double specular = 0;               ///< as by mirrors, 0..1
  double roughness = radians(0.74);  ///< rad, rms slope of the mirrors
};

/// A hinge. The mesh file shows it at the angle 0.
struct Joint {
  Vector3d axis = Vector3d::UnitX();  ///< unit, model frame; angles are right-handed about it
  Vector3d point = Vector3d::Zero();  ///< on the axis, model frame, m
  double low = 0;                     ///< rad
  double high = 0;                    ///< rad, at least `low`
  double rest = 0;                    ///< rad, from low to high: its position as mounted
};

/// T_model_part of a part that its joint has turned by so much (rad) from where the mesh shows it.
Pose turned(const Joint& joint, double angle);

/// Whether a part is worth scanning: rigid and well known, or soft, shiny, moving.
enum class ScanPreference { none, prefer, avoid };

/// Faces of a target that are alike: how far they may be from the mesh, and how they look.
struct TargetPart {
  std::string name;
  /// Standard deviation of the true surface's distance from the mesh, along its normal, and its
  /// correlation length l (correlation exp(-d^2 / 2 l^2)), m.
  double surface_sigma = 0.0005;
  double correlation_length = 0.3;
  Material material{0.5, 0.3};
  ScanPreference scan = ScanPreference::none;
  std::optional<Joint> joint;  ///< the part turns as one
};

/// A place where a chaser docks.
struct DockingPort {
  std::string name;
  Pose pose;                           ///< T_model_port; z out of the interface, towards the chaser
  double approach_cone = radians(60);  ///< half angle about that z within which it is approached
};

/// The satellite that the replica arm holds, in the model frame: a mesh and its description.
struct Target {
  std::string name;   ///< of its folder, or the mesh file's stem
  Mesh mesh;          ///< metres, as held by the arm: joints at rest
  std::string hash;   ///< content_hash(mesh)
  double length = 0;  ///< largest side of the bounding box, m
  /// By name; the first is the default of commands that name none.
  std::vector<DockingPort> ports;
  /// The first one is the default part, of the triangles that no other part claims.
  std::vector<TargetPart> parts{1};
  /// Index into parts, of each triangle of the mesh; empty: all are of the default part.
  std::vector<std::uint16_t> part_of;
  std::optional<Pose> mount;  ///< T_flange_model; nothing: by the layout's rule
  /// Where the model's origin is in the file's own coordinates, m: not 0 where the file's origin is
  /// far from the mesh, as in coordinates of a map.
  Vector3d file_origin = Vector3d::Zero();
  std::vector<std::filesystem::path> files;  ///< description and mesh, or the mesh alone
  /// SHA-256 over the description as written, without the mesh; empty: a bare mesh.
  std::string description_hash;

  std::uint16_t part_index(std::size_t triangle) const {
    return part_of.empty() ? std::uint16_t{0} : part_of[triangle];
  }
  const TargetPart& part(std::size_t triangle) const { return parts[part_index(triangle)]; }
  bool is_bare() const { return description_hash.empty(); }
  /// Surface sigma of a part, m; `bare` where the target has no description.
  double surface_sigma(const TargetPart& of, double bare) const {
    return is_bare() ? bare : of.surface_sigma;
  }
  /// The port of that name, the first for an empty name; nullptr where there is none.
  const DockingPort* port(const std::string& port_name = {}) const;
};

/// Name of the file that describes a target in its folder.
inline constexpr char target_file[] = "target.yaml";

/// Whether `targets/` (shared_files()) has one of that name.
bool is_target_name(const std::string& name);

/// Where a target that a user names is: a name of `targets/` (shared_files()), a folder with a
/// target.yaml, or a mesh file (PLY, STL, OBJ).
/// @throws InputError that lists the names there are.
std::filesystem::path find_target(const std::string& name);

/// The target a user names, as by find_target(). length > 0 scales mesh, poses and boxes so that
/// the largest side of the bounding box is so long (m); 0 keeps the size of the folder or mesh. A
/// bare mesh is used in its own axes, about its own origin; where that is far_from_origin, about
/// the centre of its bounding box.
/// @throws InputError as find_target, load_mesh and Config, or for a negative length.
Target load_target(const std::string& name, double length);

/// Copies a target's files into a directory that is made where it is not there: as a folder of its
/// name, or the mesh alone. @return where it is then.
/// @throws InputError
std::filesystem::path copy_target(const Target& target, const std::filesystem::path& into);

/// The mesh with the parts' joints turned by so much from their present position.
/// @param angles rad, as many as parts; used for parts with a joint only
Mesh turned_mesh(const Target& target, const std::vector<double>& angles);

/// The mesh with all places where its joints can bring a part, by steps of 5 deg: for keeping clear
/// of it.
Mesh swept_mesh(const Target& target);

/// Warnings about a target, a sentence each, with the remedy: its length, origin or thickness,
/// inward faces, faces left out.
std::vector<std::string> target_notes(const Target& target);

}  // namespace berth
