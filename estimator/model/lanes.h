// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstring>

#include "common/core/pose.h"

namespace berth::estimator {

/// Four numbers in a vector register: arithmetic, comparison and ?: act on each.
using Four = double __attribute__((vector_size(32)));

inline Four four(double value) { return Four{value, value, value, value}; }
inline Four four_at(const double* from) {
  Four result;
  std::memcpy(&result, from, sizeof(result));
  return result;
}
inline Four root(const Four& value) { return _mm256_sqrt_pd(value); }

/// Four vectors of three. Sums are in Eigen's order: the same bits.
struct Four3 {
  Four x, y, z;

  Four dot(const Four3& b) const { return x * b.x + y * b.y + z * b.z; }
  void set(std::size_t lane, const Vector3d& v) {
    x[lane] = v.x();
    y[lane] = v.y();
    z[lane] = v.z();
  }
  Four3 cross(const Four3& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
};

inline Four3 operator+(const Four3& a, const Four3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Four3 operator-(const Four3& a, const Four3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Four3 operator*(const Four& s, const Four3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Four3 operator/(const Four3& a, const Four& s) { return {a.x / s, a.y / s, a.z / s}; }
inline Four3 four(const Vector3d& v) { return {four(v.x()), four(v.y()), four(v.z())}; }
/// a where the mask is set, b elsewhere.
template <class Mask>
Four3 chosen(const Mask& mask, const Four3& a, const Four3& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}

}  // namespace berth::estimator
