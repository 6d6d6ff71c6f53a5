// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "testbed/calibration/calibration.h"

namespace berth::testbed {

/// The file's text: values and sigmas for people in mm, deg and ms, the covariance as the lower
/// triangle of its factor L (L L^T, SI units), which loses nothing where parameters can hardly be
/// told apart.
std::string text_of(const Calibration& calibration);

/// @throws InputError when it cannot be written.
void write_calibration(const Calibration& calibration, const std::filesystem::path& file);
/// @throws InputError.
Calibration read_calibration(const std::filesystem::path& file);

}  // namespace berth::testbed
