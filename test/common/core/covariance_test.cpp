// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/covariance.h"

#include <limits>

#include "common/core/pose.h"
#include "test/catch.h"

using namespace berth;

TEST_CASE("A covariance is finite, symmetric and positive definite, whatever its units") {
  Vector6d variances;
  variances << 1e-12, 1e-10, 4e6, 1e-14, 0.1, 9;
  const Matrix6d good = variances.asDiagonal();
  CHECK(is_covariance(good));
  CHECK(is_covariance(Matrix3d(1e6 * Matrix3d::Identity())));

  Matrix6d bad = good;
  bad(5, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK(covariance_defect(bad) == "is not finite");
  bad(5, 0) = 1e-3;
  CHECK(covariance_defect(bad) == "is not symmetric");
  bad = good;
  bad(3, 3) = 0;  // certain
  CHECK(covariance_defect(bad) == "is not positive definite");
  bad(3, 3) = -1e-14;
  CHECK(covariance_defect(bad) == "is not positive definite");
  bad = good;
  bad(4, 5) = bad(5, 4) = std::sqrt(0.1 * 9);  // of rank five
  CHECK(covariance_defect(bad) == "is not positive definite");
}
