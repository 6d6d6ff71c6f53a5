// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/config_recorder.h"

namespace berth {
namespace {

thread_local ConfigRecorder* recorder_of_thread = nullptr;

}  // namespace

ConfigRecorder::ConfigRecorder() : before_(recorder_of_thread) { recorder_of_thread = this; }

ConfigRecorder::~ConfigRecorder() { recorder_of_thread = before_; }

ConfigRecorder* ConfigRecorder::current() { return recorder_of_thread; }

}  // namespace berth
