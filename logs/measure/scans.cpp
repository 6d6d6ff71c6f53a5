// SPDX-License-Identifier: BSD-3-Clause
#include "logs/measure/series.h"

namespace berth::logs {
namespace {

Uncertain returns(const ComparedEstimate& c) {
  return {static_cast<double>(c.estimate.returns_used), 0};
}

Uncertain residual(const ComparedEstimate& c) { return {c.estimate.residual_rms_m, 0}; }

}  // namespace

void add_scans(std::vector<Measurement>& table) {
  Family family("scans", table);
  family.estimates("returns", berth::Dimension::number, returns,
                   "returns of its scan that an estimate rests on");
  family.estimates("residual", berth::Dimension::length, residual,
                   "rms distance of those returns from the model's surface");
}

}  // namespace berth::logs
