// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/targets/target_measurement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "common/core/statistics.h"

namespace berth::targets {
namespace {

constexpr std::size_t min_returns = 100;
constexpr std::size_t max_cells = 250;   // of a fit
constexpr std::size_t some_cells = 100;  // while a joint's angle is still far off

/// A return that met a part.
struct Met {
  const TrueReturn* seen = nullptr;
  RayHit hit;
  Departure departure;
  double variance = 0;  // m^2, along the normal, of the beam model
  double cosine = 0;
  std::size_t view = 0;
};

Ray ray_of(const TrueReturn& seen, const Vector3d& direction) {
  const Pose sensor = seen.pose.inverse();
  return {sensor * seen.origin, sensor.rotation * direction};
}

/// Places from which the scans of a run were made.
class Views {
 public:
  explicit Views(const std::vector<TrueReturn>& returns) {
    for (const TrueReturn& seen : returns) of_.push_back(place_of(seen));
  }
  std::size_t of(std::size_t index) const { return of_[index]; }
  const std::vector<const TrueReturn*>& firsts() const { return firsts_; }
  std::size_t runs() const { return firsts_.empty() ? 0 : firsts_.back()->run + 1; }

 private:
  std::size_t place_of(const TrueReturn& seen) {
    for (std::size_t i = 0; i < firsts_.size(); ++i) {
      // The last one most often.
      const std::size_t at = (last_ + i) % firsts_.size();
      if (firsts_[at]->run == seen.run && distance(firsts_[at]->pose, seen.pose) < 0.1 &&
          angle_between(firsts_[at]->pose, seen.pose) < radians(5)) {
        return last_ = at;
      }
    }
    firsts_.push_back(&seen);
    return last_ = firsts_.size() - 1;
  }

  std::vector<std::size_t> of_;
  std::vector<const TrueReturn*> firsts_;
  std::size_t last_ = 0;
};

/// What is known of all errors a priori.
ErrorInformation prior_of(const Views& views, const BeamModel& beam) {
  const auto runs = run_errors * static_cast<Eigen::Index>(views.runs());
  const auto all = runs + view_errors * static_cast<Eigen::Index>(views.firsts().size());
  ErrorInformation prior{Eigen::MatrixXd::Zero(all, all), Eigen::VectorXd::Zero(all)};
  const auto put = [&](Eigen::Index at, const Matrix6d& covariance) {
    const Matrix6d third = covariance / 3 + 1e-14 * Matrix6d::Identity();  // it may be singular
    prior.matrix.block<6, 6>(at, at) = third.llt().solve(Matrix6d::Identity());
  };
  std::size_t run = views.runs();
  for (std::size_t v = 0; v < views.firsts().size(); ++v) {
    const TrueReturn& seen = *views.firsts()[v];
    put(runs + view_errors * static_cast<Eigen::Index>(v), seen.covariance);
    if (seen.run == run) continue;
    run = seen.run;
    const auto at = run_errors * static_cast<Eigen::Index>(run);
    Matrix6d to_sensor = Matrix6d::Identity();  // p - r x t: of the sensor's own origin
    to_sensor.topRightCorner<3, 3>() = skew(seen.pose.position);
    put(at, to_sensor * seen.covariance * to_sensor.transpose());
    Matrix6d to_model = Matrix6d::Zero();
    to_model.topLeftCorner<3, 3>() = seen.pose.rotation.conjugate().toRotationMatrix();
    to_model.bottomRightCorner<3, 3>() = to_model.topLeftCorner<3, 3>();
    put(at + 6, to_model * seen.covariance * to_model.transpose());
    prior.matrix(at + 12, at + 12) = 1 / (beam.range_sigma_m * beam.range_sigma_m);
  }
  return prior;
}

/// Of a departure, by the errors of its view and its run.
ErrorGradient gradient_of(const Departure& departure, const Pose& pose) {
  const Vector3d shift = departure.by_error.head<3>();
  const Vector3d turn = departure.by_error.segment<3>(3);
  const Quaterniond back = pose.rotation.conjugate();
  ErrorGradient by;
  by << shift, turn, shift, turn + pose.position.cross(shift), back * shift, back * turn,
      departure.by_error[6];
  return by;
}

/// Whether the whole footprint of a beam, and a margin about it, meets one plane of one part.
bool is_inside_face(const Target& target, const RayCaster& caster, const TrueReturn& seen,
                    const RayHit& hit, const BeamModel& beam) {
  constexpr double margin = 0.01;  // m: surfaces depart from the mesh, and so do their edges
  const double aside = (0.5 * beam.footprint(hit.range) + margin) / hit.range;
  const Vector3d right = seen.direction.unitOrthogonal();
  const Vector3d down = seen.direction.cross(right);
  const Ray middle = ray_of(seen, seen.direction);
  const Vector3d place = middle.origin + hit.range * middle.direction;
  for (const Vector3d& way : {right, Vector3d(-right), down, Vector3d(-down)}) {
    const Ray ray = ray_of(seen, (seen.direction + aside * way).normalized());
    RayHit other;
    if (!caster.cast(ray, 2 * hit.range, other) ||
        target.part_index(other.triangle) != target.part_index(hit.triangle) ||
        std::abs(hit.normal.dot(ray.origin + other.range * ray.direction - place)) > margin) {
      return false;
    }
  }
  return true;
}

/// Returns of each part, by truth and a mesh.
std::vector<std::vector<Met>> met_parts(const Target& target, const Mesh& mesh,
                                        const std::vector<TrueReturn>& returns,
                                        const BeamModel& beam, const Views& views) {
  const RayCaster caster(mesh);
  const double reach = 0.05 * bounding_box(mesh).size().maxCoeff();
  std::vector<std::vector<Met>> met(target.parts.size());
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const TrueReturn& seen = returns[i];
    Met m;
    m.seen = &seen;
    const Ray ray = ray_of(seen, seen.direction);
    if (!caster.cast(ray, seen.range + reach, m.hit)) continue;
    m.cosine = -m.hit.normal.dot(ray.direction);
    const auto& part = target.part(m.hit.triangle);
    m.departure = departure_of(seen, m.hit, part.joint ? &*part.joint : nullptr);
    if (std::abs(m.departure.value) > reach || m.cosine < 0.2) continue;
    if (!is_inside_face(target, caster, seen, m.hit, beam)) continue;
    const double sigma = seen.range_sigma > 0 ? seen.range_sigma : beam.range_sigma_m;
    m.variance = m.cosine * m.cosine * sigma * sigma +
                 m.hit.range * m.hit.range * (1 - m.cosine * m.cosine) * beam.angle_variance();
    m.variance = std::max(m.variance, 1e-10);
    m.view = views.of(i);
    met[target.part_index(m.hit.triangle)].push_back(m);
  }
  return met;
}

/// Removes outliers: beyond four robust standard deviations of the median.
void gate(std::vector<Met>& met) {
  for (int round = 0; round < 2 && met.size() > min_returns; ++round) {
    std::vector<double> values;
    for (const Met& m : met) values.push_back(m.departure.value);
    const double middle = upper_median(values);
    for (double& value : values) value = std::abs(value - middle);
    const double limit = 4 * 1.4826 * upper_median(values);
    std::erase_if(met, [&](const Met& m) { return std::abs(m.departure.value - middle) > limit; });
  }
}

/// Cells of a size, with a side of the surface each.
using CellKey = std::array<int, 5>;
CellKey key_of(const Met& m, double size) {
  const Ray ray = ray_of(*m.seen, m.seen->direction);
  const Vector3d place = ray.origin + m.hit.range * ray.direction;
  Eigen::Index axis = 0;
  m.hit.normal.cwiseAbs().maxCoeff(&axis);
  CellKey key{};
  for (int i = 0; i < 3; ++i) {
    key[static_cast<std::size_t>(i)] = static_cast<int>(std::floor(place[i] / size));
  }
  key[3] = static_cast<int>(axis);
  key[4] = m.hit.normal[axis] > 0 ? 1 : 0;
  return key;
}

struct Cells {
  double size = 0;                       // m
  std::map<CellKey, std::size_t> count;  // of returns
};

/// As fine as there may be cells.
Cells cells_of(const std::vector<Met>& met, double finest, std::size_t max_count) {
  Cells cells;
  for (cells.size = finest;; cells.size *= 1.3) {
    cells.count.clear();
    for (const Met& m : met) ++cells.count[key_of(m, cells.size)];
    if (cells.count.size() <= max_count) return cells;
  }
}

/// Half as large, only so many, about the place with the most returns.
Cells finer(const std::vector<Met>& met, double size, std::size_t max_count) {
  Cells cells;
  cells.size = 0.5 * size;
  for (const Met& m : met) ++cells.count[key_of(m, cells.size)];
  const auto busiest =
      std::max_element(cells.count.begin(), cells.count.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  const CellKey centre = busiest->first;
  const auto far = [&centre](const CellKey& key) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) sum += std::pow(key[i] - centre[i], 2);
    return sum;
  };
  std::vector<std::pair<double, CellKey>> order;
  for (const auto& [key, count] : cells.count) order.emplace_back(far(key), key);
  std::sort(order.begin(), order.end());
  for (std::size_t i = max_count; i < order.size(); ++i) cells.count.erase(order[i].second);
  return cells;
}

SurfaceData data_of(const std::vector<Met>& met, const Cells& cells, const Views& views,
                    const Joint* joint) {
  struct Sum {
    double weight = 0;
    std::size_t count = 0;
    double departure = 0;
    double squares = 0;
    ErrorGradient by_error = ErrorGradient::Zero();
    double by_angle = 0;
  };
  SurfaceData data;
  std::map<CellKey, std::size_t> index;
  for (const auto& [key, count] : cells.count) index.emplace(key, index.size());
  data.places.assign(index.size(), Vector3d::Zero());
  data.normals.assign(index.size(), Vector3d::Zero());
  std::vector<double> seen(index.size(), 0);
  std::map<std::pair<std::size_t, std::size_t>, Sum> sums;  // view, cell
  for (const Met& m : met) {
    const auto place = index.find(key_of(m, cells.size));
    if (place == index.end()) continue;
    const double weight = 1 / m.variance;
    Sum& sum = sums[{m.view, place->second}];
    sum.weight += weight;
    ++sum.count;
    sum.departure += weight * m.departure.value;
    sum.squares += weight * m.departure.value * m.departure.value;
    sum.by_error += weight * gradient_of(m.departure, m.seen->pose);
    sum.by_angle += weight * m.departure.by_angle;
    const Ray ray = ray_of(*m.seen, m.seen->direction);
    data.places[place->second] += ray.origin + m.hit.range * ray.direction;
    data.normals[place->second] += m.hit.normal;
    seen[place->second] += 1;
  }
  for (std::size_t i = 0; i < data.places.size(); ++i) {
    data.places[i] /= seen[i];
    data.normals[i].normalize();
  }
  // The noise that there is, over that of the beam model: scatter within a cell as seen from one
  // place.
  double scatter = 0;
  double freedom = 0;
  for (const auto& [where, sum] : sums) {
    scatter += sum.squares - sum.departure * sum.departure / sum.weight;
    freedom += static_cast<double>(sum.count - 1);
  }
  const double scale = freedom > 30 ? std::max(scatter / freedom, 0.01) : 1;
  data.runs = views.runs();
  for (const TrueReturn* first : views.firsts()) data.views.push_back({first->run, {}});
  for (const auto& [where, sum] : sums) {
    data.views[where.first].means.push_back({where.second, sum.departure / sum.weight,
                                             scale / sum.weight, sum.by_error / sum.weight,
                                             sum.by_angle / sum.weight});
  }
  if (joint != nullptr) data.angle_sigma = std::max(joint->high - joint->low, radians(1));
  return data;
}

/// The angle beyond the mesh, within the joint's range, at which the most returns that no other
/// part explains lie on the part.
double coarse_angle(const Target& target, std::size_t part,
                    const std::vector<TrueReturn>& returns) {
  constexpr std::size_t max_points = 1500;
  constexpr double too_far = 0.05;  // m
  const Joint& joint = *target.parts[part].joint;
  std::vector<std::uint32_t> turning;
  std::vector<std::uint32_t> standing;
  for (std::uint32_t i = 0; i < target.mesh.triangles.size(); ++i) {
    (target.part_index(i) == part ? turning : standing).push_back(i);
  }
  const Mesh own = cut_out(target.mesh, turning);
  const RayCaster caster(own);
  const RayCaster others(cut_out(target.mesh, standing));
  double reach = 0;
  for (const Vector3d& v : own.vertices) reach = std::max(reach, (v - joint.point).norm());
  std::vector<Vector3d> points;
  const std::size_t step = 1 + returns.size() / 20000;
  for (std::size_t i = 0; i < returns.size(); i += step) {
    const Ray ray = ray_of(returns[i], returns[i].direction);
    const Vector3d point = ray.origin + returns[i].range * ray.direction;
    if ((point - joint.point).norm() > reach + too_far) continue;
    RayHit hit;
    if (others.cast(ray, returns[i].range + too_far, hit) &&
        hit.range > returns[i].range - too_far) {
      continue;
    }
    points.push_back(point);
  }
  if (points.size() < min_returns) return 0;
  const std::size_t every = 1 + points.size() / max_points;
  const auto cost = [&](double angle) {
    const Pose part_model = turned(joint, angle).inverse();
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); i += every) {
      const Vector3d point = part_model * points[i];
      sum += std::min((caster.nearest(point) - point).squaredNorm(), too_far * too_far);
    }
    return sum;
  };
  const double low = joint.low - joint.rest;
  const double high = joint.high - joint.rest;
  double best = 0;
  double min_cost = cost(0);
  const auto search = [&](double from, double to, double by) {
    for (double angle = std::max(from, low); angle <= std::min(to, high); angle += by) {
      const double value = cost(angle);
      if (value >= min_cost) continue;
      min_cost = value;
      best = angle;
    }
  };
  search(low, high, radians(1));
  search(best - radians(1), best + radians(1), radians(0.2));
  return best;
}

std::optional<SurfaceFit> fit_part(const std::vector<Met>& met, const Views& views,
                                   const ErrorInformation& known, const Joint* joint, double size,
                                   std::size_t cell_count) {
  if (met.size() < min_returns) return std::nullopt;
  Cells cells = cells_of(met, 0.004 * size, cell_count);
  std::optional<SurfaceFit> fit;
  for (int round = 0; round < 4; ++round) {
    if (cells.count.size() < 10) break;
    fit = fit_surface(data_of(met, cells, views, joint), known);
    if (fit->correlation_length.value > 2 * cells.size) break;
    cells = finer(met, cells.size, cell_count);
  }
  return fit;
}

/// @param turn_sigma rad, of the surface against the beam
std::optional<Measured> reflectivity_of(const std::vector<Met>& met, const Material& material,
                                        const MeasurementSettings& settings, double turn_sigma,
                                        double patch, std::string& note) {
  const double beyond = std::cos(std::max(3 * material.roughness, radians(10)));
  using Patches = std::map<std::pair<std::size_t, CellKey>, std::vector<double>>;
  std::vector<double> found;
  Patches patches;  // of each view
  double slope = 0;
  const auto look = [&](bool all) {
    for (const Met& m : met) {
      if (m.seen->power >= 1 || (!all && m.cosine > beyond)) continue;
      const double distance = m.hit.range / settings.full_scale_range;
      found.push_back(m.seen->power * distance * distance / m.cosine);
      patches[{m.view, key_of(m, patch)}].push_back(found.back());
      slope += std::sqrt(1 - std::min(1.0, m.cosine * m.cosine)) / m.cosine;
    }
    return found.size() >= min_returns;
  };
  if (!look(material.specular <= 0)) {
    found.clear();
    patches.clear();
    slope = 0;
    if (!look(true)) return std::nullopt;
    note = "seen only where its mirrors may be: reflectivity too high";
  }
  const auto count = static_cast<double>(found.size());
  const double middle = upper_median(std::move(found));
  double scatter = 0;  // of the weighted mean of patches
  for (const auto& [where, values] : patches) {
    const double share = static_cast<double>(values.size()) / count;
    scatter += share * share * std::pow(upper_median(values) - middle, 2);
  }
  const auto number = static_cast<double>(patches.size());
  if (number > 1) scatter *= number / (number - 1);
  // Lambert's cosine: d ln value / d incidence is its tangent.
  const double by_turn = middle * slope / count * turn_sigma;
  return Measured{middle, std::sqrt(scatter + by_turn * by_turn)};
}

}  // namespace

Departure departure_of(const TrueReturn& seen, const RayHit& hit, const Joint* joint) {
  const Pose sensor = seen.pose.inverse();
  const Vector3d direction = sensor.rotation * seen.direction;
  const Vector3d place = sensor * seen.origin + hit.range * direction;  // on the mesh
  Departure departure;
  const double along = hit.normal.dot(direction);
  departure.value = (seen.range - hit.range) * along;
  const Vector3d normal = seen.pose.rotation * hit.normal;
  const Vector3d arm = seen.origin + seen.range * seen.direction - seen.pose.position;
  departure.by_error << -normal, -arm.cross(normal), along;
  if (joint != nullptr) {
    departure.by_angle = hit.normal.dot(joint->axis.cross(place - joint->point));
  }
  return departure;
}

std::vector<PartMeasurement> measure_parts(const Target& target,
                                           const std::vector<TrueReturn>& returns,
                                           const MeasurementSettings& settings) {
  const double size = bounding_box(target.mesh).size().maxCoeff();
  std::vector<double> angles(target.parts.size(), 0);
  bool any_joint = false;
  for (std::size_t i = 0; i < target.parts.size(); ++i) {
    if (!target.parts[i].joint) continue;
    angles[i] = coarse_angle(target, i, returns);
    any_joint = true;
  }
  const Views views(returns);
  std::vector<PartMeasurement> found(target.parts.size());
  std::vector<ErrorInformation> information(target.parts.size());  // by each part, of errors
  // A part's information on the errors depends on its estimated smoothness, and that on the
  // information from the other parts.
  const int rounds = any_joint || target.parts.size() > 1 ? 3 : 1;
  for (int round = 0; round < rounds; ++round) {
    auto met = met_parts(target, turned_mesh(target, angles), returns, settings.beam, views);
    const bool is_last = round + 1 == rounds;
    for (std::size_t i = 0; i < target.parts.size(); ++i) {
      const TargetPart& part = target.parts[i];
      const Joint* joint = part.joint ? &*part.joint : nullptr;
      gate(met[i]);
      PartMeasurement& result = found[i];
      result = {};
      result.part = part.name;
      result.returns = met[i].size();
      ErrorInformation known = prior_of(views, settings.beam);
      for (std::size_t k = 0; k < information.size(); ++k) {
        if (k != i && information[k].vector.size() > 0) known += information[k];
      }
      auto fit = fit_part(met[i], views, known, joint, size, is_last ? max_cells : some_cells);
      if (!fit) {
        result.note = "too few returns away from edges: at least " + std::to_string(min_returns) +
                      " are needed";
        continue;
      }
      information[i] = std::move(fit->errors);
      if (joint != nullptr) {
        angles[i] = std::clamp(angles[i] + fit->angle.value, joint->low - joint->rest,
                               joint->high - joint->rest);
        result.joint_angle = Measured{joint->rest + angles[i], fit->angle.sigma};
      }
      result.surface_sigma = fit->sigma;
      result.correlation_length = fit->correlation_length;
      const double truth =
          std::sqrt(met[i].front().seen->covariance(3, 3) + fit->angle.sigma * fit->angle.sigma);
      result.reflectivity =
          reflectivity_of(met[i], part.material, settings, truth, 0.1 * size, result.note);
    }
  }
  return found;
}

}  // namespace berth::targets
