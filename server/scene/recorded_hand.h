// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "devices/replay/replay_device.h"

namespace tendon {

/// Reads the motion of the hand, of the first device, for a ReplayDevice. Steps without a position are gaps in the
/// motion. Throws std::runtime_error for the errors of `RecordingReader`, if there are fewer than 2 positions, or if
/// there are more than `kMaxRecordedSamples`.
std::vector<ReplayDevice::Sample> read_recorded_hand(const std::filesystem::path& recording);

}  // namespace tendon
