// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "devices/spacemouse/report.h"
#include "devices/spacemouse/spacemouse_device.h"
#include "tests/fuzz/target.h"

// A packet is accepted only if its id and length belong to a report. For every cap position, the speed of the simulated
// handle stays within the scene's limit.

using namespace tendon;
using spacemouse::Axes;
using spacemouse::Battery;
using spacemouse::Buttons;

namespace {

void append(std::vector<std::uint8_t>& bytes, const std::optional<Axes>& axes) {
  if (!axes) return;
  for (const int value : *axes) {
    bytes.push_back(static_cast<std::uint8_t>(value & 255));
    bytes.push_back(static_cast<std::uint8_t>((value >> 8) & 255));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> bytes(data, data + size);  // the size is exact, so that the sanitizer detects
  const auto report = spacemouse::parse(bytes);
  const int id = size > 0 ? bytes[0] : -1;
  const bool motion = (id == 1 && (size == 7 || size == 13)) || (id == 2 && size == 7);
  const bool buttons = id == 3 && size >= 2;
  const bool battery = id == 0x17 && size >= 2 && bytes[1] <= 100;
  fuzz::require(report.has_value() == (motion || buttons || battery));
  if (!report) return 0;
  if (const auto* said = std::get_if<spacemouse::Motion>(&*report)) {
    fuzz::require(motion);
    std::vector<std::uint8_t> again{bytes[0]};
    append(again, said->translation);
    append(again, said->rotation);
    fuzz::require(again == bytes);
    if (said->translation) {
      const SpaceMouseDevice::Config config{.speed = 0.1, .dead_band = 0.05, .reach = 0.05};
      const Vec3 velocity = SpaceMouseDevice::velocity_for(config, *said->translation);
      fuzz::require(velocity.allFinite() && velocity.norm() <= config.speed * (1 + 1e-12));
    }
  } else if (const auto* held = std::get_if<Buttons>(&*report)) {
    fuzz::require(buttons);
    for (std::size_t bit = 0; bit < 32; ++bit) {
      const std::size_t at = 1 + bit / 8;
      const bool there = at < size && (bytes[at] >> (bit % 8) & 1) != 0;
      fuzz::require(((held->held >> bit) & 1U) == (there ? 1U : 0U));
    }
  } else {
    fuzz::require(battery && std::get<Battery>(*report).percent == bytes[1]);
  }
  return 0;
}
