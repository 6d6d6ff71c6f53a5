// SPDX-License-Identifier: BSD-3-Clause
// A worker that ticks: a hidden tab's own timers would be slowed down until the control is lost.
setInterval(() => postMessage(0), 500);
