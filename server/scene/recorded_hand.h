// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "devices/replay/replay_device.h"

namespace tendon {

/// How the hand moved in a recording of tendond: what a ReplayDevice plays. Of several devices the first scene's. Steps
/// in which the device gave no position leave a gap.
///
/// Throws std::runtime_error with the file's name like `RecordingReader`, when there are fewer than 2 positions, and
/// when there are more than `kMaxRecordedSamples`.
std::vector<ReplayDevice::Sample> read_recorded_hand(const std::filesystem::path& recording);

}  // namespace tendon
