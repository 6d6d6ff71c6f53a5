// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/departure_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/core/error.h"
#include "common/core/lidar_profile.h"
#include "drivers/simulated/cell_scene.h"
#include "drivers/simulated/receiver/scene.h"
#include "drivers/simulated/true_target.h"
#include "drivers/simulated/world.h"

namespace berth::benchmark {
namespace {

constexpr double soft = 0.008;      // m rms of blankets
constexpr double alike_over = 0.3;  // m, of blankets
constexpr double rate_hz = 2000;
constexpr double free_length = 3;  // m

/// m, of targets that the arm holds.
double held_length(const std::string& name) {
  static const std::map<std::string, double> lengths = {
      {"radarsat2", 3},        {"arc_target_42", 3}, {"shuttle_42", 2},
      {"ldef_orbiter", 2},     {"mgs_shrox", 2},     {"mir_orbiter", 1.5},
      {"carina_orbiter", 1.5}, {"hst_orbiter", 1.5}, {"arc_chaser_42", 1}};
  const auto known = lengths.find(name);
  return known == lengths.end() ? 2 : known->second;
}

/// Shifts what is seen of the target along the rays, as a smooth function of the place on it.
class Blanket final : public Scene {
 public:
  Blanket(Scene& under, const Pose& truth, double sigma, Random& random)
      : field_(Random(random.bits(), "blanket"), alike_over),
        sigma_(sigma),
        under_(under),
        to_model_(truth.inverse()) {}
  using Scene::cast;
  void cast(std::int64_t utime, std::span<const Ray> rays, double max_range,
            std::span<SceneHit> hits) override {
    under_.cast(utime, rays, max_range, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i].met() || !hits[i].target) continue;
      const Vector3d place = rays[i].origin + hits[i].range * rays[i].direction;
      hits[i].range += sigma_ * field_.at(to_model_ * place).x();
    }
  }

 private:
  SmoothField field_;
  double sigma_;  // m
  Scene& under_;
  Pose to_model_;
};

/// The modelled target as the world has it.
Target true_target(const Target& modelled, const Departures& world, Random& random) {
  Target target = draw_true_target(modelled, world.target, random.bits()).target;
  if (!world.turned) return target;
  const double angle = radians(random.uniform(8, 15)) * (random.uniform() < 0.5 ? -1 : 1);
  target.mesh = turned_mesh(target, std::vector<double>(target.parts.size(), angle));
  return target;
}

class Departed final : public DepartedScene {
 public:
  Departed(std::unique_ptr<Scene> scene, const Pose& truth, const Window& window,
           const BeamModel& noise, const Departures& world, Random& random)
      : under_(std::move(scene)), truth_(truth), window_(window), noise_(noise) {
    if (world.blanket > 0)
      blanket_ = std::make_unique<Blanket>(*under_, truth, world.blanket, random);
    ReceiverSettings settings;
    settings.errors = world.scanner;
    if (world.scanner.range_bias > 0) settings.errors.range_bias *= random.normal();
    settings.errors.outlier_range = truth.position.norm() + 3;
    receiver_ = std::make_unique<Receiver>(noise, settings, random.bits());
  }

  const Pose& truth() const override { return truth_; }

  Scan scan(int returns) override {
    constexpr int probes = 2000;
    Window window = window_;
    window.count = probes;
    int hits = 0;
    const auto beams = raster(window);
    for (const auto& [azimuth, elevation] : beams) {
      SceneHit hit;
      scene().cast(World::first_utime, beam_direction(azimuth, elevation), noise_.range_max_m, hit);
      if (hit.met() && hit.target) ++hits;
    }
    window.count = static_cast<int>(
        std::lround(1.0 * returns * static_cast<double>(beams.size()) / std::max(1, hits)));
    return sweep({window}, World::first_utime);
  }

  Scan sweep(const std::vector<Window>& windows, std::int64_t utime) override {
    return trials::sweep(*receiver_, scene(), windows, utime, rate_hz);
  }

 private:
  Scene& scene() { return blanket_ == nullptr ? *under_ : *blanket_; }

  std::unique_ptr<Scene> under_;
  std::unique_ptr<Scene> blanket_;
  std::unique_ptr<Receiver> receiver_;
  Pose truth_;
  Window window_;
  BeamModel noise_;
};

/// A plate between the sensor and the target, turned by up to 30 deg, whose straight edge passes
/// before the middle of it. Sensor frame.
Mesh plate_before(const Vector3d& centre, double radius, Random& random) {
  const Vector3d line_of_sight = centre.normalized();
  const Vector3d side = line_of_sight.unitOrthogonal();
  const Vector3d along = Eigen::AngleAxisd(random.uniform(0, radians(360)), line_of_sight) * side;
  const Vector3d across = Eigen::AngleAxisd(random.uniform(-radians(30), radians(30)), along) *
                          line_of_sight.cross(along);
  const double nearer = random.uniform(0.35, 0.65);
  const Vector3d edge = nearer * centre;
  const double width = 1.4 * nearer * radius;
  Mesh plate;
  for (const double out : {0.0, width}) {
    for (const double way : {-width, width}) {
      plate.vertices.emplace_back(edge + out * across + way * along);
    }
  }
  plate.triangles = {{0, 1, 2}, {1, 3, 2}};
  return plate;
}

/// Joints of the replica arm, the sensor's at home, that show the target about as
/// acquisition_survey does. The nearest to home, of all that reach one pose.
Joints draw_joints(const berth::Cell& cell, Random& random) {
  const Pose sensor = cell.sensor.tool_pose(cell.sensor.home);
  const PlacedArm& arm = cell.replica;
  for (int tries = 0; tries < 1000; ++tries) {
    const Pose drawn = pose_from_xyzwpr({random.uniform(-100, 100), random.uniform(-100, 100),
                                         random.uniform(4800, 5500), random.uniform(-5, 15),
                                         random.uniform(-25, 30), random.uniform(-50, 50)});
    const Pose flange = arm.base.inverse() * sensor * drawn * arm.tool.inverse();
    const auto solutions = arm.kinematics->inverse(flange, nullptr);
    if (solutions.empty()) continue;
    const auto away = [&arm](const InverseSolution& s) {
      double sum = 0;
      for (std::size_t i = 0; i < s.joints.size(); ++i) {
        sum += std::pow(s.joints[i] - arm.home[i], 2);
      }
      return sum;
    };
    return std::min_element(solutions.begin(), solutions.end(),
                            [&away](const auto& a, const auto& b) { return away(a) < away(b); })
        ->joints;
  }
  throw InputError("layout " + cell.layout + ": the arm cannot show " + cell.target.name +
                   " as acquisition_survey does");
}

double area_of(const Mesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const Vector3d& a = mesh.vertices[t[0]];
  return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
}

Vector3d middle_of(const Mesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
}

}  // namespace

const std::vector<Departures>& departure_worlds(const std::filesystem::path& config) {
  static const std::vector<Departures> all = [&config] {
    const auto named = [](const char* name, auto&& change) {
      Departures world;
      world.name = name;
      change(world);
      return world;
    };
    const auto warp = [](Departures& w) {
      w.target.rigid_surface = w.target.soft_surface = soft;
      w.target.surface = 1;
    };
    const auto lab = [&config](Departures& w) {
      const WorldSettings users = load_world(config, "lab");
      w.target = users.target;
      w.scanner = users.scanner;
    };
    const auto footprint = [](Departures& w) { w.scanner.footprint = true; };
    const auto drop_out = [](Departures& w) {
      w.scanner.drop_out = 0.02;
      w.scanner.drop_out_grazing = 0.5;
    };
    const auto steps = [](Departures& w) { w.scanner.range_step = 0.003; };
    const auto outliers = [](Departures& w) { w.scanner.outliers = 0.01; };
    const auto missing = [](Departures& w) { w.target.missing = 1; };
    const auto extra = [](Departures& w) { w.target.extra = 1; };
    const auto turned = [](Departures& w) { w.turned = true; };
    const auto blanket = [](double sigma) {
      return [sigma](Departures& w) {
        w.blanket = sigma;
        w.once = sigma != soft;
      };
    };
    const auto half_hidden = [](Departures& w) { w.half_hidden = w.once = true; };
    const auto another = [](Departures& w) { w.another = w.once = true; };
    return std::vector<Departures>{named("as believed", [](Departures&) {}),
                                   named("lab", lab),
                                   named("blanket", blanket(soft)),
                                   named("blanket of 2 mm", blanket(0.002)),
                                   named("blanket of 4 mm", blanket(0.004)),
                                   named("blanket of 16 mm", blanket(0.016)),
                                   named("warp", warp),
                                   named("footprint", footprint),
                                   named("drop-out", drop_out),
                                   named("steps", steps),
                                   named("outliers", outliers),
                                   named("part missing", missing),
                                   named("part too many", extra),
                                   named("part turned", turned),
                                   named("half hidden", half_hidden),
                                   named("another target", another),
                                   named("all of it", [&](Departures& w) {
                                     warp(w);
                                     footprint(w);
                                     drop_out(w);
                                     steps(w);
                                     outliers(w);
                                     missing(w);
                                     extra(w);
                                     turned(w);
                                   })};
  }();
  return all;
}

Target with_appendage(Target target) {
  const Mesh& mesh = target.mesh;
  const Box box = bounding_box(mesh);
  int along = 0;
  box.size().maxCoeff(&along);
  int across = (along + 1) % 3;
  if (box.size()[(along + 2) % 3] > box.size()[across]) across = (along + 2) % 3;
  std::vector<std::size_t> outward(mesh.triangles.size());
  double area = 0;
  for (std::size_t i = 0; i < outward.size(); ++i) {
    outward[i] = i;
    area += area_of(mesh, i);
  }
  std::stable_sort(outward.begin(), outward.end(), [&](std::size_t a, std::size_t b) {
    return middle_of(mesh, a)[along] > middle_of(mesh, b)[along];
  });
  constexpr double share = 0.2;
  double beyond = 0;
  std::size_t count = 0;
  while (beyond < share * area) beyond += area_of(mesh, outward[count++]);
  TargetPart part = target.parts.front();
  part.name = "appendage";
  Joint joint;
  joint.axis = Vector3d::Unit(across);
  joint.point = box.centre();
  joint.point[along] = middle_of(mesh, outward[count - 1])[along];
  joint.low = -radians(15);
  joint.high = radians(15);
  part.joint = joint;
  target.parts = {target.parts.front(), part};
  target.part_of.assign(mesh.triangles.size(), 0);
  for (std::size_t i = 0; i < count; ++i) target.part_of[outward[i]] = 1;
  return target;
}

Target bare(Target target) {
  target.parts.resize(1);
  target.parts.front().joint.reset();
  target.part_of.assign(target.mesh.triangles.size(), 0);
  target.description_hash.clear();
  return target;
}

Target described(Target target, double surface_sigma) {
  for (TargetPart& part : target.parts) {
    part.surface_sigma = surface_sigma;
    part.correlation_length = alike_over;
  }
  target.description_hash = "described";
  return target;
}

double surface_sigma(const Departures& world) {
  constexpr double rigid = 0.0005;
  return std::max({rigid, world.blanket, world.target.rigid_surface.value_or(0)});
}

SceneMaker::SceneMaker(const std::filesystem::path& config, const std::string& target, bool held) {
  const std::string name = load_target(target, 0).name;
  target_ = with_appendage(load_target(target, held ? held_length(name) : free_length));
  noise_ = load_lidar_profile(config / "lidars" / "ilris_3d.yaml").beam;
  noise_.range_min_m = held ? 3 : 1;
  if (held) {
    cell_ = std::make_shared<berth::Cell>(load_cell(config / "layouts" / "range.yaml", target_));
  }
}

estimator::RangeGate SceneMaker::gate() const {
  if (cell_ == nullptr) return {1, 15};
  return {3, 8};  // as acquisition_survey has it
}

std::unique_ptr<DepartedScene> SceneMaker::make(const Departures& world, Random& random) const {
  const Target real = true_target(target_, world, random);
  if (cell_ != nullptr) {
    berth::Cell there = *cell_;
    const Joints joints = draw_joints(there, random);
    const Joints home = there.sensor.home;
    const Pose truth = there.relative_pose(joints, home);
    there.target = real;
    auto scene = std::make_unique<CellScene>(
        there, [joints](auto) { return joints; }, [home](auto) { return home; });
    return std::make_unique<Departed>(
        std::move(scene), truth, window_around(target_.mesh, truth, 0.3), noise_, world, random);
  }
  Pose truth{{random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 5}, random.rotation()};
  truth.position -= truth.rotation * bounding_box(target_.mesh).centre();
  auto scene = std::make_unique<MeshScene>(real.mesh);
  scene->place(World::first_utime, truth);
  if (world.half_hidden) {
    const Box box = bounding_box(real.mesh);
    scene->add_clutter(plate_before(truth * box.centre(), 0.5 * box.size().norm(), random));
  }
  return std::make_unique<Departed>(
      std::move(scene), truth, window_around(target_.mesh, truth, 0.05), noise_, world, random);
}

}  // namespace berth::benchmark
