// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/scan_likelihood.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <unordered_map>
#include <utility>

#include "common/core/statistics.h"

namespace berth::estimator {
namespace {

constexpr auto displacement = static_cast<std::size_t>(SurfaceField::displacement);
constexpr double grazing = 0.03;  // minimum cosine of incidence

/// Key of a quantised direction.
std::uint64_t side_of(const Vector3d& direction) {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    key = key * 16 + static_cast<std::uint64_t>(std::lround(2 * direction[i]) + 8);
  }
  return key;
}

/// Morton code: interleaved bits of two numbers.
std::uint64_t interleaved(std::uint32_t x, std::uint32_t y) {
  const auto spread = [](std::uint64_t v) {
    v = (v | (v << 16)) & 0x0000ffff0000ffffULL;
    v = (v | (v << 8)) & 0x00ff00ff00ff00ffULL;
    v = (v | (v << 4)) & 0x0f0f0f0f0f0f0f0fULL;
    v = (v | (v << 2)) & 0x3333333333333333ULL;
    return (v | (v << 1)) & 0x5555555555555555ULL;
  };
  return spread(x) | (spread(y) << 1);
}

/// Whether a face's incidence exceeds 45 degrees: its plane is then not extended past an edge.
bool is_oblique(const Vector3d& normal, const Vector3d& line_of_sight) {
  return !(-normal.dot(line_of_sight) > 0.7071067811865476);
}

double normal_below(double x) { return 0.5 * std::erfc(-x * 0.7071067811865476); }
double normal_at(double x) { return 0.3989422804014327 * std::exp(-0.5 * x * x); }

bool is_static(const ScanState& state) {
  return state.motion.velocity.linear.isZero(0) && state.motion.velocity.angular.isZero(0);
}

bool same(const ScanState& a, const ScanState& b) {
  const auto same_pose = [](const Pose& x, const Pose& y) {
    return x.position == y.position && x.rotation.coeffs() == y.rotation.coeffs();
  };
  return same_pose(a.motion.pose, b.motion.pose) &&
         a.motion.velocity.linear == b.motion.velocity.linear &&
         a.motion.velocity.angular == b.motion.velocity.angular && a.angles == b.angles;
}

/// A grid of points in a plane, for neighbour queries.
class PlaneGrid {
 public:
  PlaneGrid(const std::vector<std::array<double, 2>>& places, double cell) : cell_(cell) {
    if (places.empty()) return;
    std::array<double, 2> high = places.front();
    low_ = places.front();
    for (const auto& place : places) {
      for (std::size_t i = 0; i < 2; ++i) {
        low_[i] = std::min(low_[i], place[i]);
        high[i] = std::max(high[i], place[i]);
      }
    }
    constexpr double max_cells = 2000;  // a side, whatever the places
    cell_ = std::max({cell_, (high[0] - low_[0]) / max_cells, (high[1] - low_[1]) / max_cells});
    columns_ = column(high[0], 0) + 1;
    rows_ = column(high[1], 1) + 1;
    starts_.assign(index(rows_, 0) + 1, 0);
    const auto cell_at = [this](const std::array<double, 2>& place) {
      return index(column(place[1], 1), column(place[0], 0));
    };
    for (const auto& place : places) ++starts_[cell_at(place) + 1];
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    std::vector<int> next = starts_;
    members_.resize(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      members_[static_cast<std::size_t>(next[cell_at(places[i])]++)] = static_cast<int>(i);
    }
  }

  /// Points of the cell and its neighbours, which include all nearer than a cell.
  std::array<std::span<const int>, 3> near(double x, double y) const {
    std::array<std::span<const int>, 3> rows;
    const int first = std::max(0, column(x, 0) - 1);
    const int last = std::min(columns_ - 1, column(x, 0) + 1);
    if (first > last) return rows;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const int row = column(y, 1) - 1 + static_cast<int>(i);
      if (row < 0 || row >= rows_) continue;
      const int begin = starts_[index(row, first)];
      const int end = starts_[index(row, last + 1)];
      rows[i] = {members_.data() + begin, members_.data() + end};
    }
    return rows;
  }

 private:
  int column(double at, std::size_t axis) const {
    return static_cast<int>(std::floor(std::clamp((at - low_[axis]) / cell_, -10.0, 1e8)));
  }
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  double cell_;
  std::array<double, 2> low_{};
  int columns_ = 0;
  int rows_ = 0;
  std::vector<int> starts_;
  std::vector<int> members_;
};

/// Two orthonormal directions normal to `axis`.
std::pair<Vector3d, Vector3d> across(const Vector3d& axis) {
  const Vector3d x = axis.unitOrthogonal();
  return {x, axis.cross(x)};
}

}  // namespace

ScanState ScanStateLayout::moved(const ScanState& state, const Eigen::VectorXd& by) const {
  Vector12d d = Vector12d::Zero();
  d.head<6>() = by.head<6>();
  if (velocity) d.tail<6>() = by.segment<6>(6);
  ScanState result = state;
  result.motion = perturbed(state.motion, d);
  result.rim_offset += by[rim_at()];
  if (range_bias) result.range_bias += by[bias_at()];
  for (int j = 0; j < joints; ++j) {
    result.angles[static_cast<std::size_t>(j)] += by[joints_at() + j];
  }
  return result;
}

ScanLikelihood::ScanLikelihood(const TargetScene& scene, const BeamModel& beam_model,
                               const PreprocessedScan& scan, const ScanStateLayout& layout,
                               const Options& options)
    : scene_(scene), beam_model_(beam_model), layout_(layout), options_(options) {
  Vector3d sum = Vector3d::Zero();
  for (const Beam& beam : scan.beams) sum += beam.direction;
  middle_ = sum.normalized();
  const auto [right, down] = across(middle_);
  const auto grid = [](double v) { return static_cast<std::uint32_t>((v + 2) * 1e9); };
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(scan.beams.size());
  for (std::uint32_t i = 0; i < scan.beams.size(); ++i) {
    const Vector3d& d = scan.beams[i].direction;
    cone_cosine_ = std::min(cone_cosine_, d.dot(middle_));
    order[i] = {interleaved(grid(d.dot(right)), grid(d.dot(down))), i};
  }
  std::sort(order.begin(), order.end(), [&scan](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    return scan.beams[a.second].range < scan.beams[b.second].range;
  });
  const auto thinning = static_cast<std::size_t>(options.thinning);
  std::vector<double> steps;
  beams_.reserve(1 + order.size() / thinning);
  for (std::size_t i = 0; i < order.size(); i += thinning) {
    const Beam& beam = scan.beams[order[i].second];
    if (i > 0) {
      steps.push_back((beam.direction - scan.beams[order[i - 1].second].direction).norm());
    }
    beams_.push_back({beam.direction, beam.range,
                      1e-6 * static_cast<double>(beam.utime - scan.utime_mean),
                      beam.range_sigma > 0 ? beam.range_sigma : beam_model.range_sigma_m,
                      beam_model.intensity_sigma > 0 ? beam.intensity : 0});
    half_duration_ = std::max(half_duration_, std::abs(beams_.back().tau));
  }
  if (steps.empty()) return;
  spacing_ = std::sqrt(options.thinning) * upper_median(std::move(steps));
}

double ScanLikelihood::max_displacement(const ScanState& a, const ScanState& b) const {
  const double radius = 0.5 * options_.extent + options_.centre.norm();
  double moved =
      distance(a.motion.pose, b.motion.pose) + radius * angle_between(a.motion.pose, b.motion.pose);
  const Velocity& va = a.motion.velocity;
  const Velocity& vb = b.motion.velocity;
  moved +=
      half_duration_ * ((va.linear - vb.linear).norm() + radius * (va.angular - vb.angular).norm());
  for (std::size_t j = 0; j < a.angles.size(); ++j) {
    moved += 2 * radius * std::abs(a.angles[j] - b.angles[j]);
  }
  return moved;
}

double ScanLikelihood::max_view_change(const ScanState& a, const ScanState& b) const {
  const Vector3d from_a = a.motion.pose.inverse().position;
  const Vector3d from_b = b.motion.pose.inverse().position;
  double turned = std::atan2(from_a.cross(from_b).norm(), from_a.dot(from_b));
  for (std::size_t j = 0; j < a.angles.size(); ++j) turned += std::abs(a.angles[j] - b.angles[j]);
  return turned;
}

Pose ScanLikelihood::pose_of(const UsedBeam& beam, const ScanState& state) const {
  if (is_static(state)) return state.motion.pose;
  return berth::moved(state.motion.pose, state.motion.velocity, beam.tau);
}

Ray ScanLikelihood::ray_of(const UsedBeam& beam, const Pose& model_sensor) const {
  return {model_sensor.position, model_sensor.rotation * beam.direction};
}

SurfaceHit ScanLikelihood::extended_face(const RimSample& rim, const Vector3d& rim_point,
                                         const Ray& ray, const ScanState& state) const {
  SurfaceHit front = scene_.meet(state.angles, ray, rim.front.face);
  const Vector3d to = rim_point - ray.origin;
  const double along = to.dot(ray.direction);
  const bool past = (to - along * ray.direction).dot(rim.outward) < 0;
  if (front.met() && !(past && is_oblique(front.normal, ray.direction))) return front;
  front.range = along;
  front.normal = -ray.direction;
  return front;
}

void ScanLikelihood::prepare(const ScanState& state, const Stage& stage,
                             const std::vector<Surface>& surface_of_face) {
  stage_ = stage;
  surface_of_face_ = surface_of_face;
  patches_.clear();
  associations_.clear();
  pieces_ = 0;

  // Occluding edges.
  const Pose model_sensor = state.motion.pose.inverse();
  const double range = std::max(1e-3, state.motion.pose.position.norm());
  const double spacing = std::sqrt(stage.thinning) * spacing_;
  const double step = std::max(0.5 * spacing, 1e-5);
  rim_width_ =
      std::sqrt(beam_model_.edge_variance(range) + stage.annealing.rim * stage.annealing.rim);
  // After a view change by an angle, a round body's old outline is inside by radius angle^2 / 2.
  if (rims_thinning_ != stage.thinning ||
      0.25 * options_.extent * std::pow(max_view_change(rims_at_, state), 2) > 0.1 * rim_width_) {
    rims_ = scene_.rims(state.angles, model_sensor.position, model_sensor.rotation * middle_,
                        std::cos(std::acos(cone_cosine_) + 4 * spacing), step, options_.depth);
    rims_at_ = state;
    rims_thinning_ = stage.thinning;
  }
  double rim_sigma = 0;
  if (stage.patches) {
    for (const RimSample& rim : rims_) {
      rim_sigma =
          std::max(rim_sigma, scales[displacement] * surface_of_face_[rim.front.face].sigma);
    }
  }
  rim_reach_ = 3 * std::hypot(rim_width_, rim_sigma);

  // Beams that may meet edges or the target. Beams that end before its sphere met an occluder.
  const bool still = is_static(state);
  if (candidates_thinning_ != stage.thinning ||
      !(max_displacement(candidates_at_, state) + rim_reach_ <= candidates_reach_)) {
    const double reach = options_.radius + rim_reach_;
    candidates_.clear();
    const auto thinning = static_cast<std::uint32_t>(stage.thinning);
    for (std::uint32_t i = 0; i < beams_.size(); i += thinning) {
      const Vector3d middle =
          (still ? state.motion.pose : pose_of(beams_[i], state)) * options_.centre;
      if (beams_[i].range < middle.dot(beams_[i].direction) - reach) continue;
      if (middle.cross(beams_[i].direction).norm() < reach) candidates_.push_back(i);
    }
    candidates_reach_ = -1;
  }
  std::vector<Ray> rays(candidates_.size());
  std::vector<SurfaceHit> hits(candidates_.size());
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const UsedBeam& beam = beams_[candidates_[i]];
    rays[i] = ray_of(beam, still ? model_sensor : pose_of(beam, state).inverse());
  }
  scene_.cast(state.angles, rays, beam_model_.range_max_m, hits);

  const double reach = rim_reach_ / range;           // rad, across an edge
  const double cell = std::max(reach, 0.75 * step);  // and along it
  const auto [right, down] = across(middle_);
  std::vector<std::array<double, 2>> seen(rims_.size());
  for (std::size_t r = 0; r < rims_.size(); ++r) {
    const Vector3d d = (state.motion.pose * rims_[r].point).normalized();
    seen[r] = {d.dot(right), d.dot(down)};
  }
  const PlaneGrid grid(seen, cell);

  std::unordered_map<std::uint64_t, int> patch_index;
  std::vector<int> members;
  const auto patch_at = [&](const Vector3d& place, const Vector3d& direction, std::uint32_t face,
                            bool rim) {
    if (!stage.patches) return -1;
    const Surface& surface = surface_of_face_[face];
    const double size = std::clamp(3 * spacing * range, surface.correlation_length / 10,
                                   surface.correlation_length / options_.cells);
    const std::uint64_t key = cell_of(place, size) * 4099 +
                              (2 * side_of(direction) + (rim ? 1 : 0)) * 0x9e3779b97f4a7c15ULL;
    const auto [entry, fresh] = patch_index.try_emplace(key, static_cast<int>(patches_.size()));
    if (fresh) {
      patches_.push_back({Vector3d::Zero(), Vector3d::Zero(), 0, 0, rim, 0});
      members.push_back(0);
    }
    SurfacePatch& patch = patches_[static_cast<std::size_t>(entry->second)];
    patch.place += place;
    patch.direction += direction;
    patch.sigma += surface.sigma;
    patch.correlation_length += surface.correlation_length;
    const Vector3d line_of_sight = (place - model_sensor.position).normalized();
    patch.slant += rim ? 1 : 1 / std::max(grazing, -direction.dot(line_of_sight));
    ++members[static_cast<std::size_t>(entry->second)];
    return entry->second;
  };
  std::unordered_map<std::uint64_t, int> piece_index;
  rim_patches_.assign(rims_.size(), {});

  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    Association association{candidates_[i], -1, -1, -1, -1, hits[i]};
    const Ray& ray = rays[i];
    const Vector3d& direction = beams_[candidates_[i]].direction;
    const double x = direction.dot(right);
    const double y = direction.dot(down);
    double nearest = std::numeric_limits<double>::infinity();
    double nearest_across = nearest;
    const auto near_by = grid.near(x, y);
    const auto offset = [&](int r, double& away, double& distance) {
      const RimSample& rim = rims_[static_cast<std::size_t>(r)];
      const Vector3d to = rim.point - ray.origin;
      distance = to.dot(ray.direction);
      const Vector3d q = to - distance * ray.direction;
      away = rim.outward.dot(q);
      const double along2 = q.squaredNorm() - away * away;
      const double reach_m = rim_reach_ * distance / range;
      const double along_m = 0.75 * step * distance;
      return std::abs(away) < reach_m && along2 < along_m * along_m + 1e-8;
    };
    for (const std::span<const int> row : near_by) {
      for (const int r : row) {
        double away = 0;
        double distance = 0;
        if (!offset(r, away, distance)) continue;
        if (std::abs(away) < nearest) {
          nearest = std::abs(away);
          association.near = r;
        }
      }
    }
    if (association.near >= 0) {
      const RimSample& near = rims_[static_cast<std::size_t>(association.near)];
      for (const std::span<const int> row : near_by) {
        for (const int r : row) {
          double away = 0;
          double distance = 0;
          const RimSample& rim = rims_[static_cast<std::size_t>(r)];
          if (rim.outward.dot(near.outward) > -0.5 || !offset(r, away, distance)) continue;
          if (std::abs(distance - (near.point - ray.origin).dot(ray.direction)) > options_.depth) {
            continue;
          }
          if (std::abs(away) < nearest_across) {
            nearest_across = std::abs(away);
            association.across = r;
          }
        }
      }
    }
    if (!hits[i].met() && association.near < 0) continue;
    const Vector3d place = hits[i].met() ? Vector3d(ray.origin + hits[i].range * ray.direction)
                                         : rims_[static_cast<std::size_t>(association.near)].point;
    if (hits[i].met()) association.patch = patch_at(place, hits[i].normal, hits[i].face, false);
    for (const int r : {association.near, association.across}) {
      if (r < 0 || rim_patches_[static_cast<std::size_t>(r)].made) continue;
      const RimSample& rim = rims_[static_cast<std::size_t>(r)];
      RimPatches& of_rim = rim_patches_[static_cast<std::size_t>(r)];
      of_rim.made = true;
      of_rim.rim = patch_at(rim.point, rim.outward, rim.front.face, true);
      const Vector3d line_of_sight = (rim.point - model_sensor.position).normalized();
      const bool oblique = is_oblique(rim.front.normal, line_of_sight);
      of_rim.front = patch_at(rim.point, oblique ? Vector3d(-line_of_sight) : rim.front.normal,
                              rim.front.face, false);
      if (!rim.behind.met()) continue;
      of_rim.behind = patch_at(model_sensor.position + rim.behind.range * line_of_sight,
                               rim.behind.normal, rim.behind.face, false);
    }
    if (stage.pieces && hits[i].met()) {
      const auto [entry, fresh] =
          piece_index.try_emplace(cell_of(place, options_.part_cell), pieces_);
      if (fresh) ++pieces_;
      association.piece = entry->second;
    }
    associations_.push_back(association);
  }
  if (candidates_reach_ < 0) {
    candidates_.clear();
    for (const Association& association : associations_) candidates_.push_back(association.beam);
    candidates_at_ = state;
    candidates_reach_ = rim_reach_;
    candidates_thinning_ = stage.thinning;
  }
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    const double n = members[p];
    patches_[p].place /= n;
    patches_[p].direction.normalize();
    patches_[p].sigma /= n;
    patches_[p].correlation_length /= n;
    patches_[p].slant /= n;
  }
  prepared_at_ = state;
  if (stage.annealing.range == 0) sample_footprints(state);
}

/// Casts rays about each beam's axis: the mean range of a wide beam that meets several faces.
void ScanLikelihood::sample_footprints(const ScanState& state) {
  const double radius = 0.5 * beam_model_.footprint(state.motion.pose.position.norm());
  if (!(radius > 0)) return;
  if (!(max_displacement(footprints_at_, state) < radius)) {
    for (UsedBeam& beam : beams_) beam.footprint_known = false;
    footprints_at_ = state;
  }
  constexpr int about = 6;
  std::vector<const Association*> unknown;
  std::vector<Ray> middles;
  std::vector<Ray> rays;
  rays.reserve(about * associations_.size());
  for (const Association& association : associations_) {
    UsedBeam& beam = beams_[association.beam];
    if (beam.footprint_known) continue;
    beam.footprint_known = true;
    unknown.push_back(&association);
    const double range =
        association.hit.met() ? association.hit.range : state.motion.pose.position.norm();
    const double aside = 0.35 * beam_model_.footprint(range) / range;
    const Pose model_sensor = pose_of(beam, state).inverse();
    middles.push_back(ray_of(beam, model_sensor));
    const auto [x, y] = across(beam.direction);
    for (int k = 0; k < about; ++k) {
      const double angle = radians(360.0 * k / about);
      const Vector3d to = aside * (std::cos(angle) * x + std::sin(angle) * y);
      rays.push_back(
          {model_sensor.position, model_sensor.rotation * (beam.direction + to).normalized()});
    }
  }
  std::vector<SurfaceHit> met(rays.size());
  scene_.cast(state.angles, rays, beam_model_.range_max_m, met);
  for (std::size_t i = 0; i < unknown.size(); ++i) {
    const Association& association = *unknown[i];
    const std::span<const SurfaceHit> ring(met.data() + about * i, about);
    // Mean difference of the hits about a range from it, with `count` more hits at it.
    const auto mean_about = [&](double range, int estimate_shares) {
      double sum = 0;
      for (const SurfaceHit& hit : ring) {
        const double off = hit.range - range;
        if (!(std::abs(off) < 0.5 * beam_model_.pulse_length_m)) continue;
        sum += off;
        ++estimate_shares;
      }
      return estimate_shares == 0 ? 0 : sum / estimate_shares;
    };
    UsedBeam& beam = beams_[association.beam];
    beam.mixed = association.hit.met() ? mean_about(association.hit.range, 1) : 0;
    beam.mixed_front = 0;
    if (association.near < 0) continue;
    const RimSample& rim = rims_[static_cast<std::size_t>(association.near)];
    beam.mixed_front = mean_about(extended_face(rim, rim.point, middles[i], state).range, 0);
  }
}

/// Regression of a local surface error on its patch's offset, and the residual variance [the fully
/// independent training conditional of Snelson, Ghahramani, NIPS 2006].
ScanLikelihood::PatchRegression ScanLikelihood::regress_on_patch(int patch,
                                                                 const SurfacePatch& own) const {
  const double alone = offset_covariance(scales, own, own);
  if (patch < 0) return {0, alone};
  const auto at = static_cast<std::size_t>(patch);
  const double both = offset_covariance(scales, own, patches_[at]);
  const double effect =
      both / std::max(1e-300, offset_covariance(scales, patches_[at], patches_[at]));
  return {effect, std::max(0.0, alone - effect * both)};
}

ScanLikelihood::Edge ScanLikelihood::edge_at(const EvaluationPoint& at, int rim,
                                             const Ray& ray) const {
  Edge edge;
  edge.rim = &rims_[static_cast<std::size_t>(rim)];
  edge.patch = rim_patches_[static_cast<std::size_t>(rim)].rim;
  edge.point = edge.rim->point;
  edge.outward = edge.rim->outward;
  const int joint = scene_.joint_of(edge.rim->front.face);
  if (joint >= 0) {
    const Pose& since = at.turned_since[static_cast<std::size_t>(joint)];
    edge.point = since * edge.point;
    edge.outward = since.rotation * edge.outward;
  }
  const Vector3d to = edge.point - ray.origin;
  edge.apart = to - to.dot(ray.direction) * ray.direction;
  edge.across = edge.outward - edge.outward.dot(ray.direction) * ray.direction;
  edge.inside = edge.outward.dot(edge.apart);
  double variance = rim_width_ * rim_width_;
  if (stage_.patches) {
    const Surface& surface = surface_of_face_[edge.rim->front.face];
    const PatchRegression offset =
        regress_on_patch(edge.patch, {edge.point - edge.apart, edge.outward, surface.sigma,
                                      surface.correlation_length, true, 1});
    edge.effect = offset.effect;
    variance += offset.variance;
  }
  edge.width = std::sqrt(variance);
  edge.at = (edge.inside + at.state.rim_offset + edge.effect * at.offset(edge.patch)) / edge.width;
  return edge;
}

ScanLikelihood::Face ScanLikelihood::face_at(const EvaluationPoint& at, const SurfaceHit& hit,
                                             int patch, double mixed, const UsedBeam& beam,
                                             const Ray& ray) const {
  Face face;
  face.hit = hit;
  face.patch = patch;
  const double cosine = -hit.normal.dot(ray.direction);
  face.cosine = std::max(grazing, cosine);
  const double c2 = face.cosine * face.cosine;
  const double tan2 = (1 - c2) / c2;
  double surface_variance = 0;
  if (stage_.patches) {
    const Surface& surface = surface_of_face_[hit.face];
    const double sigma = scales[displacement] * surface.sigma;
    const double bend = sigma * sigma / (surface.correlation_length * c2);
    const PatchRegression offset =
        regress_on_patch(patch, {ray.origin + hit.range * ray.direction, hit.normal, surface.sigma,
                                 surface.correlation_length, false, 1 / face.cosine});
    face.effect = offset.effect;
    surface_variance = bend * bend + offset.variance;
  }
  if (stage_.annealing.range > 0) mixed = 0;
  ExpectedReturn& expected = face.expected;
  expected.residual =
      beam.range - (hit.range + mixed + at.state.range_bias) - face.effect * at.offset(patch);
  face.own_variance = std::pow(noise_scale * beam.sigma, 2) +
                      beam_model_.angle_variance() * hit.range * hit.range * tan2 +
                      surface_variance + mixed * mixed;
  expected.variance = face.own_variance + std::pow(stage_.annealing.range, 2);
  expected.drop_out = shares.drop_out_at(cosine);
  face.share_bin = static_cast<std::size_t>(std::clamp(4 * cosine, 0.0, 3.0));
  if (beam.intensity > 0) {
    // Lambert's law; anything else may have any intensity of twelve bits.
    face.white = std::log(beam.intensity * hit.range * hit.range /
                          (std::max(0.01, surface_of_face_[hit.face].reflectivity) * face.cosine));
    if (shares.white) {
      const double off = (*face.white - *shares.white) / beam_model_.intensity_sigma;
      expected.intensity_ratio = std::log(4095.0) * normal_at(off) / beam_model_.intensity_sigma;
    }
  }
  return face;
}

std::optional<ScanLikelihood::BeamGeometry> ScanLikelihood::geometry_of(
    const EvaluationPoint& at, const Association& association, const Ray& ray,
    const SurfaceHit& hit) const {
  const UsedBeam& beam = beams_[association.beam];
  if (association.near < 0 && !hit.met()) return std::nullopt;  // no longer meets the target
  BeamGeometry line_of_sight{ray, {}, {}, {}, {}};
  SurfaceHit edged;  // the front face of the edge, extended
  if (association.near >= 0) {
    line_of_sight.edges[0] = edge_at(at, association.near, ray);
    edged =
        extended_face(*line_of_sight.edges[0]->rim, line_of_sight.edges[0]->point, ray, at.state);
  }
  // Without an edge, or with one behind the hit.
  if (association.near < 0 || hit.range < edged.range - options_.depth) {
    line_of_sight.edges[0].reset();
    line_of_sight.front = face_at(at, hit, association.patch, beam.mixed, beam, ray);
    return line_of_sight;
  }
  const Edge& edge = *line_of_sight.edges[0];
  double coverage = normal_below(edge.at);
  bool inside = edge.inside >= 0 && hit.met();
  if (association.across >= 0) {
    const Edge& other = line_of_sight.edges[1].emplace(edge_at(at, association.across, ray));
    const double of_other = normal_below(other.at);
    if ((other.point - edge.point).dot(edge.outward) < 0) {  // a strut
      coverage = std::max(0.0, coverage + of_other - 1);
      inside = inside && other.inside >= 0;
    } else {  // a slit
      const int patch = rim_patches_[static_cast<std::size_t>(association.across)].front;
      line_of_sight.opposite = face_at(at, extended_face(*other.rim, other.point, ray, at.state),
                                       patch, beam.mixed_front, beam, ray);
      line_of_sight.opposite->expected.coverage = of_other;
    }
  }
  const RimPatches& patches = rim_patches_[static_cast<std::size_t>(association.near)];
  if (inside) {
    line_of_sight.front = face_at(at, hit, association.patch, beam.mixed, beam, ray);
    if (const SurfaceHit& passed = edge.rim->behind; passed.met()) {
      const SurfaceHit behind = scene_.meet(at.state.angles, ray, passed.face);
      if (behind.met() && behind.range > hit.range) {
        line_of_sight.behind = face_at(at, behind, patches.behind, 0, beam, ray);
      }
    }
  } else {
    line_of_sight.front = face_at(at, edged, patches.front, beam.mixed_front, beam, ray);
    if (hit.met()) line_of_sight.behind = face_at(at, hit, association.patch, 0, beam, ray);
  }
  line_of_sight.front.expected.coverage = coverage;
  if (line_of_sight.opposite && coverage + line_of_sight.opposite->expected.coverage >= 1) {
    // A slit that is closed: the nearer face ends before the other.
    if (line_of_sight.opposite->hit.range < line_of_sight.front.hit.range) {
      std::swap(line_of_sight.front, *line_of_sight.opposite);
      std::swap(line_of_sight.edges[0], line_of_sight.edges[1]);
    }
    line_of_sight.behind = std::exchange(line_of_sight.opposite, std::nullopt);
    line_of_sight.edges[1].reset();
  }
  return line_of_sight;
}

void ScanLikelihood::observe(const EvaluationPoint& at, const Association& association,
                             const BeamGeometry& line_of_sight, const Quaterniond& to_sensor,
                             const BeamTerm& term, Observations& observations) const {
  const UsedBeam& beam = beams_[association.beam];
  const Quaterniond& at_mean_time = at.state.motion.pose.rotation;
  // force, torque: derivatives by translation and rotation of the model, model frame.
  const auto add = [&](const Vector3d& force, const Vector3d& torque, bool edge, std::uint32_t face,
                       const Observation& observation) {
    auto j = observations.add(observation);
    j.head<3>() = to_sensor * force;
    j.segment<3>(3) = at_mean_time * torque;
    if (layout_.velocity) {
      j.segment<3>(6) = beam.tau * j.head<3>();
      j.segment<3>(9) = beam.tau * (to_sensor * torque);
    }
    if (edge) j[layout_.rim_at()] = 1;
    if (layout_.range_bias && !edge) j[layout_.bias_at()] = 1;
    const int joint = scene_.joint_of(face);
    if (joint >= 0 && joint < layout_.joints) {
      const Joint& hinge = scene_.joints()[static_cast<std::size_t>(joint)];
      j[layout_.joints_at() + joint] = hinge.axis.dot(torque - hinge.point.cross(force));
    }
  };
  constexpr double negligible = 1e-4;  // of a probability
  const auto add_range = [&](const Face& face, double probability) {
    if (!(probability > negligible)) return;
    const Vector3d force = face.hit.normal / -face.cosine;
    const Vector3d place = line_of_sight.ray.origin + face.hit.range * line_of_sight.ray.direction;
    add(force, place.cross(force), false, face.hit.face,
        {probability / face.expected.variance,
         face.expected.residual + face.effect * at.offset(face.patch), face.effect, face.patch,
         association.piece});
  };
  if (beam.returned()) {
    add_range(line_of_sight.front, term.front);
    if (line_of_sight.opposite) add_range(*line_of_sight.opposite, term.opposite);
    if (line_of_sight.behind) add_range(*line_of_sight.behind, term.behind);
  }
  for (std::size_t i = 0; i < line_of_sight.edges.size(); ++i) {
    const std::optional<Edge>& edge = line_of_sight.edges[i];
    const bool other = i == 1 && line_of_sight.opposite.has_value();
    const double coverage =
        (other ? *line_of_sight.opposite : line_of_sight.front).expected.coverage;
    if (!edge || !(coverage * (1 - coverage) > 1e-9)) continue;
    const double density = normal_at(edge->at);
    if (!(density > negligible)) continue;
    const double slope = density * (other ? term.opposite_score : term.coverage_score);
    // The curvature of -log L, a small positive number where it is not positive: the gradient
    // stays.
    const double weight = std::max(slope * (slope + edge->at), 1e-6);
    add(edge->across, edge->point.cross(edge->across) + edge->outward.cross(edge->apart), true,
        edge->rim->front.face,
        {weight / (edge->width * edge->width),
         slope * edge->width / weight + edge->effect * at.offset(edge->patch), edge->effect,
         edge->patch, association.piece});
  }
}

void ScanLikelihood::estimate_shares(const std::vector<BeamRecord>& beams,
                                     const std::vector<double>& as_modelled,
                                     Linearised& result) const {
  std::array<double, 4> met{};
  std::array<double, 4> dropped_out{};
  double passed = 0, passed_returned = 0, stray = 0, stray_beams = 0, white = 0, lit = 0;
  for (const BeamRecord& b : beams) {
    const double share = b.piece < 0 ? 1.0 : as_modelled[static_cast<std::size_t>(b.piece)];
    met[b.share_bin] +=
        share * (b.term.front + b.term.opposite + b.term.behind + b.term.dropped_out);
    dropped_out[b.share_bin] += share * b.term.dropped_out;
    passed += b.term.passed;
    result.expected += b.expected * b.expected * (1 - std::min(0.5, b.drop_out));
    const double explained = share * (b.term.front + b.term.opposite + b.term.behind);
    result.fit += b.expected * explained;
    if (!b.returned) continue;
    passed_returned += b.term.passed;
    result.returns += 1;
    result.explained += explained;
    stray += share * b.term.outlier;
    stray_beams += share;
    const double front = share * b.term.front;
    result.square_sum += front * b.square;
    result.variance_sum += front * b.variance;
    if (!b.white) continue;
    white += front * *b.white;
    lit += front;
  }
  // With a prior of 20 beams for each share.
  constexpr double before = 20;
  const BeamShares usual;
  const auto share = [](double some, double of, double as_usual) {
    return (some + before * as_usual) / (of + before);
  };
  result.shares.outlier = std::clamp(share(stray, stray_beams, usual.outlier), 1e-3, 0.5);
  for (std::size_t b = 0; b < met.size(); ++b) {
    result.shares.drop_out[b] =
        std::clamp(share(dropped_out[b], met[b], usual.drop_out[b]), 2e-3, 0.9);
  }
  result.shares.background =
      std::clamp(share(passed_returned, passed, usual.background), 0.01, 0.99);
  if (lit >= 1) result.shares.white = white / lit;
}

ScanLikelihood::Linearised ScanLikelihood::linearise(const ScanState& state,
                                                     const Eigen::VectorXd& offsets) const {
  EvaluationPoint at{state, offsets, state.motion.pose.inverse(), is_static(state), {}};
  for (std::size_t j = 0; j < state.angles.size(); ++j) {
    const Joint& joint = scene_.joints()[j];
    at.turned_since.push_back(turned(joint, state.angles[j]) *
                              turned(joint, rims_at_.angles[j]).inverse());
  }
  std::vector<Ray> rays(associations_.size());
  std::vector<SurfaceHit> hits(associations_.size());
  std::vector<Pose> poses(associations_.size(), state.motion.pose);  // when each beam was sent
  for (std::size_t i = 0; i < associations_.size(); ++i) {
    const UsedBeam& beam = beams_[associations_[i].beam];
    if (!at.still) poses[i] = pose_of(beam, state);
    rays[i] = ray_of(beam, at.still ? at.model_sensor : poses[i].inverse());
    hits[i] = associations_[i].hit;
  }
  if (!same(state, prepared_at_)) scene_.cast(state.angles, rays, beam_model_.range_max_m, hits);

  Linearised result;
  Observations observations(layout_.size(), 4 * associations_.size());
  std::vector<BeamRecord> beams;
  beams.reserve(associations_.size());
  // Log-likelihoods of pieces: as modelled, and elsewhere.
  std::vector<std::pair<double, double>> pieces(static_cast<std::size_t>(pieces_), {0, 0});
  const double anything = std::log(0.5 / options_.extent);
  std::array<double, 2> log_without;
  for (const bool returned : {false, true}) {
    log_without[returned ? 1 : 0] =
        beam_term(returned, {0, 1, 0, 1, 0}, {}, {}, {}, options_.extent).log_likelihood;
  }
  for (std::size_t i = 0; i < associations_.size(); ++i) {
    const Association& association = associations_[i];
    const std::optional<BeamGeometry> line_of_sight =
        geometry_of(at, association, rays[i], hits[i]);
    if (!line_of_sight) continue;
    const bool returned = beams_[association.beam].returned();
    std::optional<ExpectedReturn> opposite, behind;
    if (line_of_sight->opposite) opposite = line_of_sight->opposite->expected;
    if (line_of_sight->behind) behind = line_of_sight->behind->expected;
    const Face& front = line_of_sight->front;
    const BeamTerm term =
        beam_term(returned, front.expected, opposite, behind, shares, options_.extent);
    if (association.piece < 0) {
      result.log_likelihood += term.log_likelihood;
    } else {
      auto& [modelled, elsewhere] = pieces[static_cast<std::size_t>(association.piece)];
      modelled += term.log_likelihood;
      elsewhere += returned ? anything : std::log(0.5);
    }
    result.log_likelihood_without += log_without[returned ? 1 : 0];
    observe(at, association, *line_of_sight, poses[i].rotation, term, observations);
    const double met = front.expected.coverage + (opposite ? opposite->coverage : 0);
    beams.push_back({term, returned, association.piece, behind ? 1 : met, front.expected.drop_out,
                     front.share_bin, front.white,
                     front.expected.residual * front.expected.residual, front.own_variance});
  }

  std::vector<double> as_modelled(pieces.size());
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const double yes = pieces[p].first + std::log(1 - options_.elsewhere);
    const double no = pieces[p].second + std::log(options_.elsewhere);
    const double larger = std::max(yes, no);
    result.log_likelihood += larger + std::log1p(std::exp(std::min(yes, no) - larger));
    as_modelled[p] = 1 / (1 + std::exp(std::clamp(no - yes, -700.0, 700.0)));
  }
  estimate_shares(beams, as_modelled, result);
  result.sums = observations.sums(as_modelled, static_cast<Eigen::Index>(patches_.size()));
  return result;
}

}  // namespace berth::estimator
