// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace tendon::simulation {

struct SecondLookOptions {
  std::filesystem::path scene;
  std::filesystem::path trace;
  std::vector<std::string> laws;  ///< names; empty: every law that promises passivity
  double stiffness = 2000;        ///< N/m, of a wall at x = 0
  double rate_hz = 100;           ///< of its engine
  std::optional<double> length_s;
  bool json = false;
};

/// `tendon-worlds replay`: what would another law have felt on that same network? The device, the hand and the loop of
/// a scene, the wall of `tendon_virtual_wall` behind the network of a trace, and one law after the other, all else
/// equal; summarised as `tendon-report` does it.
///
/// The first link of the trace is played by time: a datagram meets the fate of the newest one recorded before it, so
/// the network is bad at the same times, whatever the session sends.
///
/// Throws std::invalid_argument for a law that nobody knows, and what reading the files throws.
void second_look(const SecondLookOptions& options, std::ostream& out);

}  // namespace tendon::simulation
