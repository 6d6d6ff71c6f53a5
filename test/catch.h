// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Catch2 2.x (Debian 12) or 3.x.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif
