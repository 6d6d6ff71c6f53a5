// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/clouds/cloud.h"
#include "estimator/single_scan.h"

/// The output of berth estimate for one cloud. Every report has the same keys, null where a value
/// is missing.
namespace berth::commands {

nlohmann::ordered_json report_of(const std::string& file, const clouds::Cloud& cloud,
                                 const estimator::PreprocessedScan& scan,
                                 const estimator::SingleScan& method,
                                 const estimator::SingleScanResult& result, std::int64_t read_us);

/// For a file that could not be used.
nlohmann::ordered_json error_report(const std::string& file, const std::string& reason);

}  // namespace berth::commands
