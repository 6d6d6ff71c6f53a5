// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace berth::evaluation {

/// One of the many hypotheses tested on the same runs, e.g. "did the rms position error on hold
/// change?". Values are NaN where a run has none.
struct Test {
  std::size_t group = 0;       ///< whose runs: the case
  std::vector<double> before;  ///< paired: of the same runs as after; else: of earlier runs
  std::vector<double> after;
  double min_effect = 0;  ///< a smaller change of the mean is none
};

struct TestResult {
  double change = 0;  ///< of the mean, after - before; NaN with too few values
  double p = 1;       ///< p-value, of any test of the family
};

/// Minimum number of pairs, or of values on either side.
inline constexpr std::size_t min_values = 8;
inline constexpr std::size_t min_new_values = 4;

struct FamilyOptions {
  std::size_t shuffles = 20000;
  std::uint64_t seed = 1;
};

/// Did anything change? Westfall and Young's (1993) max-T permutation test: it keeps the
/// probability of any false alarm in the whole family of tests, as Holm's adjustment does, but
/// correlated tests (they use the same runs) lose less power. A test counts with Student's t on the
/// scale of the normal distribution (Wallace 1959), and only while the change of the mean is at
/// least `min_effect`, in the shuffled data as in the real ones; so that tiny changes, however
/// consistent, neither raise an alarm nor mask others.
///
/// Paired: before and after trade places, run by run, in all tests of a group at once. Exact where
/// builds differ at random only.
std::vector<TestResult> paired_family(const std::vector<Test>& tests,
                                      const FamilyOptions& options = {});

/// Unpaired: runs of a group are dealt anew to before and after. Exact where tonight's runs and the
/// earlier ones have the same distribution. Run i of a group is value i of before, then of after,
/// in all its tests.
std::vector<TestResult> unpaired_family(const std::vector<Test>& tests,
                                        const FamilyOptions& options = {});

}  // namespace berth::evaluation
