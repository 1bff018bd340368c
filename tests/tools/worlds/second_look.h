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
  std::vector<std::string> laws;  ///< empty: every passive law
  double stiffness = 2000;        ///< N/m, of a wall at x = 0
  double rate_hz = 100;           ///< rate of the wall's engine
  std::optional<double> length_s;
  bool json = false;
};

/// Simulates other laws on a recorded network. Device, hand and loop come from a scene; the wall of
/// `tendon_virtual_wall` is behind the network of a trace. Only the first link of the trace is used. Each datagram has
/// the fate of the last datagram recorded before its time, so that all sessions have the same network conditions.
///
/// Throws std::invalid_argument for an unknown law, and the exceptions of the file readers.
void second_look(const SecondLookOptions& options, std::ostream& out);

}  // namespace tendon::simulation
