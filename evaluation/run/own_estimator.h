// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/run_info_t.hpp>
#include <string>

namespace berth::evaluation {

/// Attachment by which RUN_INFO names an estimator other than Berth's own; it has no content.
/// sha256: of its program or library; empty where it was started outside the run.
attachment_t attachment_of_own_estimator(const std::string& name, const std::string& sha256);

/// The estimator's name and the beginning of its hash, for people; empty: it was Berth's own.
std::string own_estimator_of(const run_info_t& info);

/// Of a log whose estimates are replaced by Berth's. @return whether there was one.
bool forget_own_estimator(run_info_t& info);

}  // namespace berth::evaluation
