// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "tests/tools/worlds/drawn_world.h"
#include "tests/tools/worlds/witness.h"

namespace tendon::simulation {

/// What became of a world.
struct Outcome {
  std::optional<Breach> breach;  ///< the first promise that was broken
  bool felt = false;             ///< a remote force was rendered
  bool limited = false;          ///< … and limited by energy
  bool turned = false;           ///< a torque was given out
  bool gripped = false;          ///< a grip force was
  int presses = 0;               ///< of buttons, that observers had to be shown and were
  bool recovered = false;        ///< it was checked that everybody is served again
  double least_energy = 0;       ///< J
  std::uint64_t steps = 0;
  Network::Counts network;
};

struct Extras {
  Network::Players players{};  ///< instead of the weather, where they decide
  Network::Watch watch{};      ///< sees every decision of the network
};

/// Runs a world from its beginning to its end, with a witness. The same world gives the same outcome.
/// Thread-safe: yes.
Outcome run(const DrawnWorld& world, const Extras& extras = {});

}  // namespace tendon::simulation
