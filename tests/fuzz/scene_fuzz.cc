// SPDX-License-Identifier: Apache-2.0
#include <string_view>

#include "server/scene/scene.h"
#include "tests/fuzz/target.h"

// A scene file must either be rejected with a SceneError, or be accepted by the device and the haptic loop.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text(std::as_bytes(std::span(data, size)));
  if (text.find('/') != std::string_view::npos) return -1;  // a recorded motion could name any file of this machine
  try {
    const Scene scene = parse_scene(text, "scene", "/nowhere");
    static Mailboxes mail({.steps = 2, .flight = 2, .datagrams = 2});
    SimulatedDevice device(scene.simulated());
    const HapticLoop loop(scene.loop, device, mail);
    fuzz::require(loop.stats().steps == 0 && scene.text == text);
  } catch (const SceneError& refused) {
    fuzz::require(std::string_view(refused.what()).starts_with("scene:"));
  }
  return 0;
}
