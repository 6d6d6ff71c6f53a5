// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace berth::terminal {

/// From now on Ctrl-C (SIGINT) and SIGTERM do not end the process but are remembered.
void watch_for_interruption();
/// From now on they end it again.
void end_on_interruption();
/// One of them came. Any thread.
bool interrupted();

}  // namespace berth::terminal
