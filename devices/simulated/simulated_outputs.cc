// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_outputs.h"

#include <variant>

#include "core/base/expect.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

SimulatedOutputs::SimulatedOutputs(const std::vector<OutputDescription>& outputs) {
  const auto count = static_cast<double>(outputs.size());
  expect(outputs.size() <= kMostOutputs, "outputs", count, "at most 8");
  for (const OutputDescription& output : outputs) {
    outputs_.push_back({.setting = turned_off(output.kind)});
  }
}

void SimulatedOutputs::set(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept {
  if (output >= outputs_.size() || outputs_[output].setting.index() != setting.index()) return;
  outputs_[output] = {.setting = setting, .since = now};
}

std::uint32_t SimulatedOutputs::colour(std::uint32_t output) const noexcept {
  if (output >= outputs_.size()) return 0;
  const auto* const lamp = std::get_if<LampColour>(&outputs_[output].setting);
  return lamp != nullptr ? lamp->rgb : 0;
}

double SimulatedOutputs::amplitude(LocalTime now, std::uint32_t output) const noexcept {
  if (output >= outputs_.size()) return 0;
  const auto* const pulse = std::get_if<Vibration>(&outputs_[output].setting);
  return pulse != nullptr && now - outputs_[output].since < pulse->duration ? pulse->amplitude : 0;
}

// Defined here because inlining it would affect a device's step.
void SimulatedDevice::set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept {
  outputs_.set(now, output, setting);
}

}  // namespace tendon
