// SPDX-License-Identifier: Apache-2.0
// This program is used by effects_proof_test.cc. `device-proof none` runs without optional effects, and `device-proof
// each` with one effect at a time. It prints the name of each effect. Callgrind counts within `live_in_turn` and writes
// a file each time the function returns.
#include <iostream>
#include <string_view>

#include "devices/simulated/simulated_device.h"

using namespace tendon;

namespace {

SimulatedDevice::Config bare() {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  config.hand =
      OperatorHand::Config{.stiffness = 300,
                           .damping = 3,
                           .mass = 0.05,
                           .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.015, .frequency = 0.5})};
  return config;
}

}  // namespace

/// This function is neither inlined nor mangled, so callgrind can find it.
extern "C" [[gnu::noinline]] void live_in_turn(SimulatedDevice& device, int from, int to) {
  for (int i = from; i < to; ++i) {
    const auto sample = device.read(LocalTime(std::chrono::milliseconds(i)));
    device.apply(-500 * sample->position);
  }
}

namespace {

void prove(std::string_view name, const SimulatedDevice::Config& config) {
  SimulatedDevice device(config);
  live_in_turn(device, 0, 500);
  live_in_turn(device, 500, 1500);
  std::cout << name << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view which = argc == 2 ? argv[1] : "";
  if (which != "none" && which != "each") return 2;
  prove("none", bare());
  if (which == "none") return 0;
  const auto with = [](std::string_view name, void (*list)(SimulatedDevice::Config&)) {
    SimulatedDevice::Config config = bare();
    list(config);
    prove(name, config);
  };
  with("viscous friction", [](SimulatedDevice::Config& config) { config.viscous_friction = 0.3; });
  with("Coulomb friction", [](SimulatedDevice::Config& config) { config.coulomb_friction = 0.1; });
  with("joint friction", [](SimulatedDevice::Config& config) {
    config.joint_friction = {.mechanism = Mechanism::Falcon{}, .coulomb = {0.01, 0.01, 0.01}};
  });
  with("structural mode",
       [](SimulatedDevice::Config& config) { config.structural_mode = {.handle_mass = 0.05, .stiffness = 5000}; });
  with("encoder", [](SimulatedDevice::Config& config) { config.encoder_step = 30e-6; });
  with("saturation", [](SimulatedDevice::Config& config) { config.max_force = 8; });
  with("amplifier", [](SimulatedDevice::Config& config) { config.amplifier_bandwidth = 200; });
  with("environment", [](SimulatedDevice::Config& config) { config.environment.emplace(); });
  with("force sensor", [](SimulatedDevice::Config& config) { config.force_sensor.emplace(); });
  with("watchdog", [](SimulatedDevice::Config& config) { config.watchdog = std::chrono::milliseconds(5); });
  with("sample delay", [](SimulatedDevice::Config& config) { config.sample_delay = std::chrono::milliseconds(1); });
  with("force delay", [](SimulatedDevice::Config& config) { config.force_delay = std::chrono::milliseconds(1); });
}
