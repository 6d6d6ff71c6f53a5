// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/scan_fit.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace berth::estimator {
namespace {

constexpr auto rim_field = static_cast<std::size_t>(SurfaceField::rim);
constexpr auto normal_field = static_cast<std::size_t>(SurfaceField::normal);
constexpr double grazing = 0.03;  // cosine, below which a range's slope is taken for this

/// A number of a cell of a grid of that size, and of the side that a direction faces.
std::uint64_t cell_of(const Vector3d& place, double size) {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::int64_t>(std::floor(place[i] / size)) + (1 << 19);
    key = (key << 20) | (static_cast<std::uint64_t>(at) & 0xfffff);
  }
  return key;
}

std::uint64_t side_of(const Vector3d& direction) {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    key = key * 16 + static_cast<std::uint64_t>(std::lround(2 * direction[i]) + 8);
  }
  return key;
}

/// Bits of two numbers in turn: near numbers are near in the order.
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

double normal_below(double x) { return 0.5 * std::erfc(-x * 0.7071067811865476); }
double normal_at(double x) { return 0.3989422804014327 * std::exp(-0.5 * x * x); }

bool stands_still(const ScanState& state) {
  return state.motion.velocity.linear.isZero(0) && state.motion.velocity.angular.isZero(0);
}

/// Two directions across another.
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

ScanFit::ScanFit(const TargetScene& scene, const BeamModel& beam_model, const CleanScan& scan,
                 const ScanStateLayout& layout, const Options& options)
    : scene_(scene), beam_model_(beam_model), layout_(layout), options_(options) {
  Vector3d sum = Vector3d::Zero();
  for (const Beam& beam : scan.beams) sum += beam.direction;
  middle_ = sum.normalized();
  const auto [right, down] = across(middle_);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < scan.beams.size(); ++i) {
    const Vector3d& d = scan.beams[i].direction;
    cone_cosine_ = std::min(cone_cosine_, d.dot(middle_));
    const auto grid = [](double v) { return static_cast<std::uint32_t>((v + 2) * 1e9); };
    order.emplace_back(interleaved(grid(d.dot(right)), grid(d.dot(down))), i);
  }
  std::sort(order.begin(), order.end(), [&scan](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    return scan.beams[a.second].range < scan.beams[b.second].range;
  });
  std::vector<double> steps;
  for (const auto& [key, i] : order) {
    const Beam& beam = scan.beams[i];
    if (!beams_.empty()) steps.push_back((beam.direction - beams_.back().direction).norm());
    beams_.push_back({beam.direction, beam.range,
                      1e-6 * static_cast<double>(beam.utime - scan.utime_mean),
                      beam.range_sigma > 0 ? beam.range_sigma : beam_model.range_sigma_m});
  }
  if (steps.empty()) return;
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                   steps.end());
  spacing_ = steps[steps.size() / 2];
}

Pose ScanFit::pose_of(const FitBeam& beam, const ScanState& state) const {
  if (stands_still(state)) return state.motion.pose;
  return berth::moved(state.motion.pose, state.motion.velocity, beam.tau);
}

Ray ScanFit::ray_of(const FitBeam& beam, const Pose& model_sensor) const {
  return {model_sensor.position, model_sensor.rotation * beam.direction};
}

void ScanFit::prepare(const ScanState& state, const Stage& stage,
                      const std::vector<Surface>& surface_of_face) {
  stage_ = stage;
  angles_ = state.angles;
  surface_of_face_ = surface_of_face;
  patches_.clear();
  active_.clear();
  pieces_ = 0;

  std::vector<Ray> rays(beams_.size());
  std::vector<SurfaceHit> hits(beams_.size());
  const Pose at_rest = state.motion.pose.inverse();
  const bool still = stands_still(state);
  for (std::size_t i = 0; i < beams_.size(); ++i) {
    rays[i] = ray_of(beams_[i], still ? at_rest : pose_of(beams_[i], state).inverse());
  }
  scene_.cast(state.angles, rays, beam_model_.range_max_m, hits);

  // Occluding edges, and beams near them.
  const Pose model_sensor = state.motion.pose.inverse();
  const double range = std::max(1e-3, state.motion.pose.position.norm());
  const double step = std::max(0.5 * spacing_, 1e-5);
  rims_ = scene_.rims(state.angles, model_sensor.position, model_sensor.rotation * middle_,
                      std::cos(std::acos(cone_cosine_) + 4 * spacing_), step, options_.depth);
  rim_width_ = std::sqrt(std::pow(0.25 * beam_model_.footprint(range), 2) +
                         beam_model_.angle_variance() * range * range +
                         stage.annealing.rim * stage.annealing.rim);
  double rim_sigma = 0;
  if (stage.patches) {
    for (const RimSample& rim : rims_) {
      rim_sigma = std::max(rim_sigma, scales[rim_field] * surface_of_face_[rim.front.face].sigma);
    }
  }
  rim_reach_ = 3 * std::hypot(rim_width_, rim_sigma);
  const double reach = rim_reach_ / range;           // rad, across an edge
  const double cell = std::max(reach, 0.75 * step);  // and along it
  const auto [right, down] = across(middle_);
  const auto bucket = [cell](double x, double y) {
    const auto ix = static_cast<std::int64_t>(std::floor(x / cell));
    const auto iy = static_cast<std::int64_t>(std::floor(y / cell));
    return static_cast<std::uint64_t>((ix + (1LL << 30)) << 32) ^
           static_cast<std::uint64_t>(iy + (1LL << 30));
  };
  struct Placed {
    std::uint64_t bucket;
    int rim;
  };
  std::vector<Placed> placed;
  placed.reserve(rims_.size());
  for (std::size_t r = 0; r < rims_.size(); ++r) {
    const Vector3d d = (state.motion.pose * rims_[r].point).normalized();
    placed.push_back({bucket(d.dot(right), d.dot(down)), static_cast<int>(r)});
  }
  std::sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    return a.bucket != b.bucket ? a.bucket < b.bucket : a.rim < b.rim;
  });
  std::unordered_map<std::uint64_t, std::pair<int, int>> buckets;
  for (int i = 0; i < static_cast<int>(placed.size()); ++i) {
    const auto at = static_cast<std::size_t>(i);
    auto [entry, fresh] = buckets.try_emplace(placed[at].bucket, i, i + 1);
    if (!fresh) entry->second.second = i + 1;
  }

  std::unordered_map<std::uint64_t, int> patch_index;
  std::vector<int> members;
  const auto patch_at = [&](const Vector3d& place, const Vector3d& direction, std::uint32_t face,
                            bool rim) {
    if (!stage.patches) return -1;
    const Surface& surface = surface_of_face_[face];
    const double size = std::clamp(3 * spacing_ * range, surface.correlation_length / 10,
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
    const Vector3d sight = (place - model_sensor.position).normalized();
    patch.slant += rim ? 1 : 1 / std::max(grazing, -direction.dot(sight));
    ++members[static_cast<std::size_t>(entry->second)];
    return entry->second;
  };
  std::unordered_map<std::uint64_t, int> piece_index;
  rim_patches_.assign(rims_.size(), {});

  for (std::uint32_t i = 0; i < beams_.size(); ++i) {
    Active active{i, -1, -1, -1, -1, 0, 0};
    const Ray& ray = rays[i];
    const double x = beams_[i].direction.dot(right);
    const double y = beams_[i].direction.dot(down);
    double nearest = std::numeric_limits<double>::infinity();
    double nearest_across = nearest;
    std::array<std::pair<int, int>, 9> found;
    std::size_t count = 0;
    for (int u = -1; u <= 1; ++u) {
      for (int v = -1; v <= 1; ++v) {
        const auto entry = buckets.find(bucket(x + u * cell, y + v * cell));
        if (entry != buckets.end()) found[count++] = entry->second;
      }
    }
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
    for (std::size_t k = 0; k < count; ++k) {
      for (int j = found[k].first; j < found[k].second; ++j) {
        double away = 0;
        double distance = 0;
        const int r = placed[static_cast<std::size_t>(j)].rim;
        if (!offset(r, away, distance)) continue;
        if (std::abs(away) < nearest) {
          nearest = std::abs(away);
          active.near = r;
        }
      }
    }
    if (active.near >= 0) {
      const RimSample& near = rims_[static_cast<std::size_t>(active.near)];
      for (std::size_t k = 0; k < count; ++k) {
        for (int j = found[k].first; j < found[k].second; ++j) {
          double away = 0;
          double distance = 0;
          const int r = placed[static_cast<std::size_t>(j)].rim;
          const RimSample& rim = rims_[static_cast<std::size_t>(r)];
          if (rim.outward.dot(near.outward) > -0.5 || !offset(r, away, distance)) continue;
          if (std::abs(distance - (near.point - ray.origin).dot(ray.direction)) > options_.depth) {
            continue;
          }
          if (std::abs(away) < nearest_across) {
            nearest_across = std::abs(away);
            active.across = r;
          }
        }
      }
    }
    if (!hits[i].met() && active.near < 0) continue;
    const Vector3d place = hits[i].met() ? Vector3d(ray.origin + hits[i].range * ray.direction)
                                         : rims_[static_cast<std::size_t>(active.near)].point;
    if (hits[i].met()) active.patch = patch_at(place, hits[i].normal, hits[i].face, false);
    for (const int r : {active.near, active.across}) {
      if (r < 0 || rim_patches_[static_cast<std::size_t>(r)].made) continue;
      const RimSample& rim = rims_[static_cast<std::size_t>(r)];
      RimPatches& of_rim = rim_patches_[static_cast<std::size_t>(r)];
      of_rim.made = true;
      of_rim.rim = patch_at(rim.point, rim.outward, rim.front.face, true);
      of_rim.front = patch_at(rim.point, rim.front.normal, rim.front.face, false);
      if (!rim.behind.met()) continue;
      const Vector3d sight = (rim.point - model_sensor.position).normalized();
      of_rim.behind = patch_at(model_sensor.position + rim.behind.range * sight, rim.behind.normal,
                               rim.behind.face, false);
    }
    if (stage.pieces && hits[i].met()) {
      const auto [entry, fresh] =
          piece_index.try_emplace(cell_of(place, options_.part_cell), pieces_);
      if (fresh) ++pieces_;
      active.piece = entry->second;
    }
    active_.push_back(active);
  }
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    const double n = members[p];
    patches_[p].place /= n;
    patches_[p].direction.normalize();
    patches_[p].sigma /= n;
    patches_[p].correlation_length /= n;
    patches_[p].slant /= n;
  }
  if (stage.annealing.range == 0) look_at_footprints(state, hits);
}

/// Rays about each beam's own: what a wide beam that meets several faces reads.
void ScanFit::look_at_footprints(const ScanState& state, const std::vector<SurfaceHit>& hits) {
  constexpr int about = 6;
  std::vector<Ray> rays;
  std::vector<Active*> whose;
  for (Active& active : active_) {
    if (!hits[active.beam].met()) continue;
    const FitBeam& beam = beams_[active.beam];
    const double radius = 0.5 * beam_model_.footprint(hits[active.beam].range);
    if (!(radius > 0)) return;
    const Pose model_sensor = pose_of(beam, state).inverse();
    const auto [x, y] = across(beam.direction);
    for (int k = 0; k < about; ++k) {
      const double angle = radians(360.0 * k / about);
      const Vector3d aside =
          (0.7 * radius / hits[active.beam].range) * (std::cos(angle) * x + std::sin(angle) * y);
      rays.push_back(
          {model_sensor.position, model_sensor.rotation * (beam.direction + aside).normalized()});
    }
    whose.push_back(&active);
  }
  std::vector<SurfaceHit> met(rays.size());
  scene_.cast(state.angles, rays, beam_model_.range_max_m, met);
  for (std::size_t i = 0; i < whose.size(); ++i) {
    double sum = 0;
    int count = 1;
    for (int k = 0; k < about; ++k) {
      const double off =
          met[about * i + static_cast<std::size_t>(k)].range - hits[whose[i]->beam].range;
      if (!(std::abs(off) < 0.5 * beam_model_.pulse_length_m)) continue;
      sum += off;
      ++count;
    }
    whose[i]->mixed_mean = sum / count;
    whose[i]->mixed_square = whose[i]->mixed_mean * whose[i]->mixed_mean;
  }
}

ScanFit::Linearised ScanFit::linearise(const ScanState& state,
                                       const Eigen::VectorXd& offsets) const {
  const int size = layout_.size();
  const auto patch_count = static_cast<Eigen::Index>(patches_.size());
  std::vector<Ray> rays(active_.size());
  std::vector<SurfaceHit> hits(active_.size());
  const Pose at_rest = state.motion.pose.inverse();
  const bool still = stands_still(state);
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const FitBeam& beam = beams_[active_[i].beam];
    rays[i] = ray_of(beam, still ? at_rest : pose_of(beam, state).inverse());
  }
  scene_.cast(state.angles, rays, beam_model_.range_max_m, hits);

  std::vector<Pose> turned_since;
  for (std::size_t j = 0; j < state.angles.size(); ++j) {
    const Joint& joint = scene_.joints()[j];
    turned_since.push_back(turned(joint, state.angles[j]) * turned(joint, angles_[j]).inverse());
  }

  struct Observation {
    double weight;
    double residual;  // at zero offset
    double effect;    // of the offset
    int patch;
    int piece;
  };
  std::vector<Observation> observations;
  observations.reserve(2 * active_.size());
  Eigen::MatrixXd jacobian(size, static_cast<Eigen::Index>(4 * active_.size()));
  const auto offset_of = [&offsets](int patch) { return patch < 0 ? 0 : offsets[patch]; };
  // How an error of a beam's own place follows its patch's offset, and what is left of its variance
  // [the fully independent training conditional of Snelson, Ghahramani, NIPS 2006].
  struct Follows {
    double effect = 0;
    double variance = 0;
  };
  const auto follows = [&](int patch, const SurfacePatch& own) {
    const auto covariance = [this](const SurfacePatch& a, const SurfacePatch& b) {
      double sum = 0;
      for (std::size_t f = 0; f < scales.size(); ++f) {
        sum += scales[f] * scales[f] * offset_covariance(surface_fields[f], a, b);
      }
      return sum;
    };
    const double alone = covariance(own, own);
    if (patch < 0) return Follows{0, alone};
    const SurfacePatch& with = patches_[static_cast<std::size_t>(patch)];
    const double both = covariance(own, with);
    const double effect = both / std::max(1e-300, covariance(with, with));
    return Follows{effect, std::max(0.0, alone - effect * both)};
  };

  std::vector<std::pair<double, double>> piece_sums(static_cast<std::size_t>(pieces_), {0, 0});
  struct Expected {  // what shares are counted from
    double bin_met[4] = {0, 0, 0, 0};
    double bin_missed[4] = {0, 0, 0, 0};
    double passed = 0, passed_returned = 0;
  } counts;
  struct Kept {
    BeamTerm term;
    double coverage;
    double drop_out;
    int piece;
    int bin;
    bool returned;
    double square;
    double variance;
  };
  std::vector<Kept> kept;
  kept.reserve(active_.size());
  Linearised result;
  const double unknown = 0.5 / options_.extent;

  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Active& active = active_[i];
    const FitBeam& beam = beams_[active.beam];
    const Ray& ray = rays[i];
    const bool returned = beam.range < std::numeric_limits<double>::infinity();

    // Occluding edges.
    struct Rim {
      double away = 0;
      Vector3d point, outward;  // of the sample, as its part has turned since
      Vector3d q, across;
      const RimSample* sample = nullptr;
      int patch = -1;
      double density = 0;  // d c / d away
      double effect = 0;   // of the patch's offset
      double width = 0;
    };
    std::array<Rim, 2> rims;
    double coverage = 1;
    const auto place_rim = [&](int r, Rim& rim) {
      rim.sample = &rims_[static_cast<std::size_t>(r)];
      rim.patch = rim_patches_[static_cast<std::size_t>(r)].rim;
      rim.point = rim.sample->point;
      rim.outward = rim.sample->outward;
      const int joint = scene_.joint_of(rim.sample->front.face);
      if (joint >= 0) {
        const Pose& since = turned_since[static_cast<std::size_t>(joint)];
        rim.point = since * rim.point;
        rim.outward = since.rotation * rim.outward;
      }
      const Vector3d to = rim.point - ray.origin;
      rim.q = to - to.dot(ray.direction) * ray.direction;
      rim.across = rim.outward - rim.outward.dot(ray.direction) * ray.direction;
      rim.away = rim.outward.dot(rim.q);
      double variance = rim_width_ * rim_width_;
      if (stage_.patches) {
        const Surface& surface = surface_of_face_[rim.sample->front.face];
        const Follows offset = follows(rim.patch, {rim.point - rim.q, rim.outward, surface.sigma,
                                                   surface.correlation_length, true, 1});
        rim.effect = offset.effect;
        variance += offset.variance;
      }
      rim.width = std::sqrt(variance);
      const double x =
          (rim.away + state.rim_offset + rim.effect * offset_of(rim.patch)) / rim.width;
      rim.density = normal_at(x) / rim.width;
      return normal_below(x);
    };
    if (active.near >= 0) {
      coverage = place_rim(active.near, rims[0]);
      if (active.across >= 0) {
        coverage = std::max(0.0, coverage + place_rim(active.across, rims[1]) - 1);
      }
    }

    // Faces.
    SurfaceHit front = hits[i];
    SurfaceHit behind;
    int front_patch = active.patch;
    int behind_patch = -1;
    bool front_is_met = true;
    if (active.near >= 0) {
      const RimSample& rim = *rims[0].sample;
      const RimPatches& patches = rim_patches_[static_cast<std::size_t>(active.near)];
      front_is_met =
          front.met() && rims[0].away >= 0 && (rims[1].sample == nullptr || rims[1].away >= 0);
      if (front_is_met) {
        if (rim.behind.met()) behind = scene_.meet(state.angles, ray, rim.behind.face);
        behind_patch = patches.behind;
      } else {
        behind = hits[i];
        behind_patch = active.patch;
        front = scene_.meet(state.angles, ray, rim.front.face);
        front_patch = patches.front;
        const double at = (rims[0].point - ray.origin).norm();
        if (!(std::abs(front.range - at) < 10 * rim_width_ + 0.1)) front.range = at;  // oblique
      }
      if (behind.met() && !(behind.range > front.range)) behind = {};
    } else if (!front.met()) {
      continue;  // not before the target any more
    }

    struct Met {
      double cosine, slope_cosine, effect;
      ExpectedReturn expected;
    };
    const auto expect = [&](const SurfaceHit& hit, int patch, bool middle) {
      Met met;
      met.cosine = -hit.normal.dot(ray.direction);
      met.slope_cosine = std::max(grazing, met.cosine);
      const double c2 = met.slope_cosine * met.slope_cosine;
      const double tan2 = (1 - c2) / c2;
      const Surface& surface = surface_of_face_[hit.face];
      double surface_variance = 0;
      met.effect = 0;
      if (stage_.patches) {
        const double sigma = scales[normal_field] * surface.sigma;
        const double bend = sigma * sigma / (surface.correlation_length * c2);
        const Follows offset =
            follows(patch, {ray.origin + hit.range * ray.direction, hit.normal, surface.sigma,
                            surface.correlation_length, false, 1 / met.slope_cosine});
        met.effect = offset.effect;
        surface_variance = bend * bend + offset.variance;
      }
      const double mixed = middle ? active.mixed_mean : 0;
      met.expected.residual =
          beam.range - (hit.range + mixed + state.range_bias) - met.effect * offset_of(patch);
      met.expected.variance = std::pow(noise_scale * beam.sigma, 2) +
                              std::pow(stage_.annealing.range, 2) +
                              beam_model_.angle_variance() * hit.range * hit.range * tan2 +
                              surface_variance + (middle ? active.mixed_square : 0);
      met.expected.drop_out = shares.drop_out_at(met.cosine);
      return met;
    };
    const Met f = expect(front, front_patch, front_is_met);
    std::optional<Met> g;
    std::optional<ExpectedReturn> g_expected;
    if (behind.met()) {
      g = expect(behind, behind_patch, false);
      g_expected = g->expected;
    }
    const BeamTerm term =
        beam_term(returned, coverage, f.expected, g_expected, shares, options_.extent);

    // What shares and pieces are made of.
    kept.push_back({term, behind.met() ? 1.0 : coverage, f.expected.drop_out, active.piece,
                    static_cast<int>(std::clamp(4 * f.cosine, 0.0, 3.0)), returned,
                    term.front * f.expected.residual * f.expected.residual,
                    term.front * (f.expected.variance - std::pow(stage_.annealing.range, 2))});
    if (active.piece >= 0) {
      auto& [modelled, elsewhere] = piece_sums[static_cast<std::size_t>(active.piece)];
      modelled += term.log_likelihood;
      elsewhere += std::log(returned ? unknown : 0.5);
    } else {
      result.log_likelihood += term.log_likelihood;
    }

    // What it says of the state.
    const Quaterniond to_sensor = pose_of(beam, state).rotation;
    const Velocity& velocity = state.motion.velocity;
    const auto add = [&](const Vector3d& force, const Vector3d& torque, bool rim,
                         std::uint32_t face, double weight, double residual, double effect,
                         int patch) {
      auto j = jacobian.col(static_cast<Eigen::Index>(observations.size()));
      j.setZero();
      j.head<3>() = to_sensor * force;
      const Vector3d turn = to_sensor * torque;
      j.segment<3>(3) = turn;
      if (beam.tau != 0 && !velocity.angular.isZero(0)) {
        j.segment<3>(3) = rotation_from_vector(-beam.tau * velocity.angular) * turn;
      }
      if (layout_.velocity) {
        j.segment<3>(6) = beam.tau * j.head<3>();
        j.segment<3>(9) = beam.tau * turn;
      }
      if (rim) j[layout_.rim_at()] = 1;
      if (layout_.range_bias && !rim) j[layout_.bias_at()] = 1;
      const int joint = scene_.joint_of(face);
      if (joint >= 0 && joint < layout_.joints) {
        const Joint& hinge = scene_.joints()[static_cast<std::size_t>(joint)];
        j[layout_.joints_at() + joint] = hinge.axis.dot(torque - hinge.point.cross(force));
      }
      observations.push_back(
          {weight, residual + effect * offset_of(patch), effect, patch, active.piece});
    };
    const auto add_range = [&](const SurfaceHit& hit, const Met& met, double probability,
                               int patch) {
      if (!(probability > 1e-4)) return;
      const Vector3d place = ray.origin + hit.range * ray.direction;
      const Vector3d force = hit.normal / -met.slope_cosine;
      const Vector3d torque = place.cross(force);
      add(force, torque, false, hit.face, probability / met.expected.variance,
          met.expected.residual, met.effect, patch);
    };
    if (returned) {
      add_range(front, f, term.front, front_patch);
      if (g) add_range(behind, *g, term.behind, behind_patch);
    }
    for (const Rim& rim : rims) {
      if (rim.sample == nullptr || !(rim.density * rim.width > 1e-4)) continue;
      const double spread = coverage * (1 - coverage);
      if (!(spread > 1e-9)) continue;
      const double score = rim.density * term.coverage_score;
      // Fisher's information, but never a step farther than the edge's width reaches.
      const double weight = std::max(rim.density * rim.density / spread * term.coverage_certainty,
                                     std::abs(score) / (2 * rim.width));
      if (!(weight * rim.width * rim.width > 1e-6)) continue;
      const Vector3d torque = rim.point.cross(rim.across) + rim.outward.cross(rim.q);
      add(rim.across, torque, true, rim.sample->front.face, weight, score / weight, rim.effect,
          rim.patch);
    }
  }

  // Pieces: as modelled or elsewhere.
  std::vector<double> modelled(static_cast<std::size_t>(pieces_), 1);
  for (int p = 0; p < pieces_; ++p) {
    const auto at = static_cast<std::size_t>(p);
    const double yes = piece_sums[at].first + std::log(1 - options_.elsewhere);
    const double no = piece_sums[at].second + std::log(options_.elsewhere);
    const double larger = std::max(yes, no);
    result.log_likelihood += larger + std::log1p(std::exp(std::min(yes, no) - larger));
    modelled[at] = 1 / (1 + std::exp(std::clamp(no - yes, -700.0, 700.0)));
  }
  const auto share_of = [&modelled](int piece) {
    return piece < 0 ? 1.0 : modelled[static_cast<std::size_t>(piece)];
  };
  double stray_beams = 0;
  double stray = 0;
  for (const Kept& k : kept) {
    const double share = share_of(k.piece);
    const auto bin = static_cast<std::size_t>(k.bin);
    const double met_here = share * (k.term.front + k.term.behind + k.term.missed);
    counts.bin_met[bin] += met_here;
    counts.bin_missed[bin] += share * k.term.missed;
    counts.passed += k.term.passed;
    if (k.returned) counts.passed_returned += k.term.passed;
    result.expected += k.coverage * (1 - std::min(0.5, k.drop_out));
    const double as_modelled = share * (k.term.front + k.term.behind);
    result.fit += k.coverage * as_modelled;
    if (k.returned) {
      result.returns += 1;
      result.explained += as_modelled;
      stray += share * k.term.outlier;
      stray_beams += share;
      result.square_sum += share * k.square;
      result.variance_sum += share * k.variance;
    }
  }
  // Each share as if some beams had been seen before that were as is usual.
  constexpr double before = 20;
  const BeamShares usual;
  result.shares.outlier =
      std::clamp((stray + before * usual.outlier) / (stray_beams + before), 1e-3, 0.5);
  for (std::size_t b = 0; b < 4; ++b) {
    result.shares.drop_out[b] = std::clamp(
        (counts.bin_missed[b] + before * usual.drop_out[b]) / (counts.bin_met[b] + before), 2e-3,
        0.9);
  }
  result.shares.background = std::clamp(
      (counts.passed_returned + before * usual.background) / (counts.passed + before), 0.01, 0.99);

  // Sums.
  const auto n = static_cast<Eigen::Index>(observations.size());
  NormalEquations& sums = result.sums;
  sums.patch_information = Eigen::VectorXd::Zero(patch_count);
  sums.patch_gradient = Eigen::VectorXd::Zero(patch_count);
  sums.coupling = Eigen::MatrixXd::Zero(patch_count, size);
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(size, patch_count);
  Eigen::VectorXd weights(n);
  Eigen::VectorXd residuals(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Observation& o = observations[static_cast<std::size_t>(k)];
    const double w = o.weight * share_of(o.piece);
    weights[k] = w;
    residuals[k] = o.residual;
    if (o.patch < 0) continue;
    sums.patch_information[o.patch] += w * o.effect * o.effect;
    sums.patch_gradient[o.patch] += w * o.effect * o.residual;
    coupling.col(o.patch) += w * o.effect * jacobian.col(k);
  }
  sums.coupling = coupling.transpose();
  const Eigen::MatrixXd weighted = jacobian.leftCols(n) * weights.asDiagonal();
  sums.information = weighted * jacobian.leftCols(n).transpose();
  sums.gradient = weighted * residuals;
  return result;
}

}  // namespace berth::estimator
