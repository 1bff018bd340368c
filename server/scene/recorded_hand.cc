// SPDX-License-Identifier: Apache-2.0
#include "server/scene/recorded_hand.h"

#include <stdexcept>
#include <string>

#include "server/recording/recording_reader.h"
#include "server/tables/recorded_motion.h"

namespace tendon {

std::vector<ReplayDevice::Sample> read_recorded_hand(const std::filesystem::path& recording) {
  const auto fail = [&recording](const std::string& what) {
    throw std::runtime_error(recording.string() + ": " + what);
  };
  std::vector<ReplayDevice::Sample> samples;
  RecordingReader reader(recording);
  while (const auto record = reader.next()) {
    const auto* step = std::get_if<StepRecord>(&*record);
    if (step == nullptr || step->reasons.has(Reason::kUnseen)) continue;
    if (samples.size() == kMaxRecordedSamples) {
      fail("expected at most " + std::to_string(kMaxRecordedSamples) + " steps, found more");
    }
    samples.push_back({step->hand.at.time_since_epoch(), step->hand.position});
  }
  if (samples.size() < 2) {
    fail("expected 2 or more steps with a position of the device, found " + std::to_string(samples.size()));
  }
  return samples;
}

}  // namespace tendon
