// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/run_setup.h"
#include "testbed/calibration/calibration.h"

namespace berth::testbed {

/// The cell as it is best known, and by which calibration.
struct CalibratedCell {
  Cell cell;  ///< takes reported joints
  Calibration calibration;
};

/// Where a run's calibration is looked for: config/calibration/<layout>.yaml.
std::filesystem::path calibration_file(const RunSetup& run);

/// SHA-256 over the layout and arm files: a calibration is of these and no others.
std::string geometry_hash(const RunSetup& run);

/// Of a cell without a calibration file.
Calibration nominal_calibration(const RunSetup& run, const Cell& nominal);

/// The run's cell with its calibration, or the nominal one where there is no file. With another
/// target than the calibration's, that target's mount is the nominal one again, and the basis says
/// so. @throws InputError, also when the file is of another layout or other arm files.
CalibratedCell load_calibrated_cell(const RunSetup& run);

}  // namespace berth::testbed
