// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace berth::report {

/// page.css and page.js, put into the program when it is built.
extern const char* const page_style;
extern const char* const page_script;

}  // namespace berth::report
