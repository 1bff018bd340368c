// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/control/preset.h"
#include "devices/simulated/scripted_motion.h"
#include "tests/tools/lab/experiments/experiment.h"

namespace tendon::playground {

/// The values of the sliders. description() contains the bounds.
struct Settings {
  double delay_ms = 0;      ///< of each direction
  double jitter_ms = 0;     ///< largest deviation from the delay
  double loss_percent = 0;  ///< of each direction
  double stiffness = 0;     ///< N/m, of the wall at x = 0
  double seed = 0;          ///< of the network, an integer
  std::size_t law = 0;      ///< index in `laws` of description()
};

Settings usual_settings();

/// JSON with the sliders and their bounds, the laws, the columns of a row, the period and the reach of the hand.
std::string description();

/// The tendon-lab command that runs the hand of deploy/scenes/demo.toml with the same settings.
std::string command(const Settings& settings);

/// The device and the impedance of the hand are those of deploy/scenes/demo.toml. `wish` must outlive the experiment.
/// Throws std::invalid_argument if a setting is out of bounds.
lab::Experiment experiment_of(const Settings& settings, const ScriptedMotion::Point& wish);

/// A simulated device with a hand that is moved by the mouse. The results do not depend on the machine.
class Playground {
 public:
  /// The hand starts at rest at (x, y), in m. Throws as experiment_of.
  Playground(const Settings& settings, double x, double y);

  /// Runs `count` periods, in which the wished position moves to (x, y) at a constant speed. Returns a row for each
  /// period, in the order of `columns` of description(). Valid until the next call. Throws std::invalid_argument if a
  /// position is beyond the reach of the hand.
  std::span<const double> step(int count, double x, double y);

 private:
  ScriptedMotion::Point wish_;
  lab::LiveRun run_;
  std::vector<double> rows_;
};

}  // namespace tendon::playground

// The C functions of the WebAssembly module. The returned text is valid until the next call of such a function.
extern "C" {
const char* playground_description();
const char* playground_command(double delay_ms, double jitter_ms, double loss_percent, double stiffness, double seed,
                               double law);
tendon::playground::Playground* playground_create(double delay_ms, double jitter_ms, double loss_percent,
                                                  double stiffness, double seed, double law, double x, double y);
void playground_destroy(tendon::playground::Playground* playground);
const double* playground_step(tendon::playground::Playground* playground, int count, double x, double y);
}
