// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/scan_regions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <vector>

#include "common/core/pose.h"
#include "common/core/statistics.h"

namespace berth::estimator {

namespace {

/// Points sorted into cubes, for neighbour queries of one fixed radius. Deterministic order.
class PointIndex {
 public:
  PointIndex(const std::vector<Vector3d>& points, double cell) : points_(points), cell_(cell) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      cells_[key(points[i])].push_back(static_cast<std::uint32_t>(i));
    }
  }

  /// Calls visit(index) for every point within radius <= cell of the query.
  template <class Visit>
  void for_neighbours(const Vector3d& query, double radius, Visit visit) const {
    const auto [x, y, z] = key(query);
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto found = cells_.find({x + dx, y + dy, z + dz});
          if (found == cells_.end()) continue;
          for (const std::uint32_t i : found->second) {
            if ((points_[i] - query).squaredNorm() <= radius * radius) visit(i);
          }
        }
      }
    }
  }

 private:
  using Key = std::tuple<int, int, int>;
  Key key(const Vector3d& p) const {
    return {static_cast<int>(std::floor(p.x() / cell_)),
            static_cast<int>(std::floor(p.y() / cell_)),
            static_cast<int>(std::floor(p.z() / cell_))};
  }

  const std::vector<Vector3d>& points_;
  double cell_;
  std::map<Key, std::vector<std::uint32_t>> cells_;
};

// Offset of a neighbourhood's centroid over its radius, by integration: inside a face 0, edge of a
// box 0.30, edge of a thin panel 0.42, corner of a box 0.49, corner of a panel 0.60.
constexpr double edge_offset = 0.22;
constexpr double corner_offset = 0.36;
constexpr double corner_contrast = 1.2;  ///< of a corner over the edges that meet in it

struct Neighbourhood {
  double offset = 0;  // of its centroid, in radii
  int count = 0;
};

std::vector<Neighbourhood> neighbourhoods(const std::vector<Vector3d>& points, double radius) {
  const PointIndex index(points, radius);
  std::vector<Neighbourhood> result(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vector3d sum = Vector3d::Zero();
    index.for_neighbours(points[i], radius, [&](std::uint32_t j) {
      sum += points[j] - points[i];
      ++result[i].count;
    });
    result[i].offset = sum.norm() / (result[i].count * radius);
  }
  return result;
}

DirectionSet majority_visibility(const std::vector<SurfaceSample>& samples,
                                 const std::vector<std::uint32_t>& members) {
  DirectionSet result;
  for (int i = 0; i < direction_count; ++i) {
    std::size_t seen = 0;
    for (const std::uint32_t m : members) seen += samples[m].visible_from.contains(i) ? 1 : 0;
    // Of a box edge half of the samples are visible normal to one face, of a panel's edge one side.
    if (3 * seen >= members.size()) result.insert(i);
  }
  return result;
}

/// Takes candidates in the order given, each at least `spacing` from those taken before.
std::vector<std::uint32_t> spread_out(const std::vector<Vector3d>& points,
                                      const std::vector<std::uint32_t>& candidates,
                                      double spacing) {
  std::vector<std::uint32_t> taken;
  for (const std::uint32_t c : candidates) {
    const bool free = std::all_of(taken.begin(), taken.end(), [&](std::uint32_t t) {
      return (points[t] - points[c]).squaredNorm() >= spacing * spacing;
    });
    if (free) taken.push_back(c);
  }
  return taken;
}

}  // namespace

std::vector<ScanRegion> find_scan_regions(const std::vector<SurfaceSample>& samples,
                                          double radius) {
  std::vector<Vector3d> points;
  points.reserve(samples.size());
  for (const SurfaceSample& s : samples) points.push_back(s.position.cast<double>());
  std::vector<Neighbourhood> around = neighbourhoods(points, radius);
  // Where samples are sparse a small neighbourhood's centroid is dominated by their noise.
  constexpr int min_median = 60;
  std::vector<int> counts;
  for (const Neighbourhood& n : around) counts.push_back(n.count);
  if (!counts.empty()) {
    const int median = upper_median(std::move(counts));
    if (median < min_median) {
      radius *= std::sqrt(static_cast<double>(min_median) / median);
      around = neighbourhoods(points, radius);
    }
  }
  const PointIndex index(points, 2 * radius);

  // A corner is a local maximum and exceeds the edges around it.
  std::vector<std::uint32_t> corners;
  std::vector<std::uint32_t> edges;
  constexpr int min_count = 12;  // fewer samples are of an isolated strut
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (around[i].count < min_count || around[i].offset < edge_offset) continue;
    edges.push_back(static_cast<std::uint32_t>(i));
    if (around[i].offset < corner_offset) continue;
    bool leads = true;
    std::vector<double> edges_around;
    index.for_neighbours(points[i], 2 * radius, [&](std::uint32_t j) {
      const double distance = (points[j] - points[i]).norm();
      if (distance < radius && around[j].offset > around[i].offset) leads = false;
      if (distance > radius && around[j].offset > edge_offset)
        edges_around.push_back(around[j].offset);
    });
    if (!leads) continue;
    if (!edges_around.empty() &&
        around[i].offset < corner_contrast * upper_median(std::move(edges_around))) {
      continue;
    }
    corners.push_back(static_cast<std::uint32_t>(i));
  }
  const auto sharpest_first = [&](std::uint32_t a, std::uint32_t b) {
    return around[a].offset != around[b].offset ? around[a].offset > around[b].offset : a < b;
  };
  std::sort(corners.begin(), corners.end(), sharpest_first);
  std::sort(edges.begin(), edges.end(), sharpest_first);
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0U);

  std::vector<ScanRegion> regions;
  const auto add = [&](const std::vector<std::uint32_t>& centres, ScanRegion::Kind kind,
                       double region_radius) {
    for (const std::uint32_t c : centres) {
      std::vector<std::uint32_t> members;
      index.for_neighbours(points[c], region_radius,
                           [&](std::uint32_t j) { members.push_back(j); });
      regions.push_back({kind, samples[c].position, samples[c].normal,
                         static_cast<float>(region_radius), majority_visibility(samples, members)});
    }
  };
  add(spread_out(points, corners, 1.5 * radius), ScanRegion::Kind::corner, radius);
  add(spread_out(points, edges, 2 * radius), ScanRegion::Kind::edge, radius);
  add(spread_out(points, all, 2.4 * radius), ScanRegion::Kind::surface, 1.6 * radius);
  return regions;
}

}  // namespace berth::estimator
