// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "tests/tools/worlds/drawn_world.h"
#include "tests/tools/worlds/invariant_checker.h"

namespace tendon::simulation {

struct Outcome {
  std::optional<Breach> breach;  ///< the first violated invariant
  bool felt = false;             ///< a remote force was rendered
  bool limited = false;          ///< a remote force was limited by energy
  bool turned = false;           ///< a torque was commanded
  bool gripped = false;          ///< a grip force was commanded
  int presses = 0;               ///< number of button presses that observers have received
  bool recovered = false;        ///< the recovery of all clients was checked
  double least_energy = 0;       ///< J
  std::uint64_t steps = 0;
  Network::Counts network;
};

struct Extras {
  Network::Players players{};  ///< optional deciders that replace the injectors
  Network::Watch watch{};      ///< observes all decisions of the network
};

/// Deterministic. Thread-safe: yes.
Outcome run(const DrawnWorld& world, const Extras& extras = {});

}  // namespace tendon::simulation
