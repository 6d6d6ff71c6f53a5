#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The console in headless Chromium. PICTURES names a directory for the pictures that the documentation shows.
. "$(dirname "$0")/common.sh"
/usr/bin/python3 test/system/console_browser.py "$bin/berth" "$work" "$url" ${PICTURES:+"$PICTURES"}
! pgrep -f "$work/runs" || fail "processes are left behind"
