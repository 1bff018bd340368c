// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "server/scene/scene.h"
#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/worlds/network.h"

namespace tendon::lab {

/// A run of the grid: the server with one engine that renders a wall at x = 0, behind a network.
struct GridCell {
  std::string law;       ///< see GridBench::scene_of
  std::string network;   ///< a profile line, the name of a network, or "trace:FILE"
  double stiffness = 0;  ///< N/m, of the wall
  double rate_hz = 0;    ///< of the engine
  std::uint64_t seed = 0;
};

/// What was measured from the first force that reached the hand until the end of the run. Empty: not known, because no
/// force reached the hand, no datagram was sent in a direction, or the hand was never in contact.
struct Measured {
  std::optional<double> round_trip{};  ///< s, sum of the median delays of both directions
  std::optional<double> loss{};        ///< fraction of the datagrams in both directions
  /// N/m, mean of force/depth where the hand is deeper than a tenth of its maximum depth (core/PROOFS.md, "Operational
  /// stiffness")
  std::optional<double> felt_stiffness{};
  std::optional<double> least_energy{};   ///< J, of the true ledger: exact positions and the device's true friction
  std::optional<double> vibration{};      ///< m/s, see Outcome::late_vibration
  std::optional<double> felt_db{};        ///< dB above the detection threshold of the hand (perception.h)
  std::optional<double> force_error{};    ///< N, rms of the applied force minus the force of the wall at the hand
  std::optional<double> limited_share{};  ///< fraction of the periods in which the limiter changes the force
};

/// What all cells of a grid share: the scene, its laws and networks. Throws std::invalid_argument if the device is not
/// simulated or there are several, and SceneError or the exceptions of the readers for other invalid input.
class GridBench {
 public:
  explicit GridBench(const std::filesystem::path& scene);

  /// The scene with a law. `law` is "scene" for the limiter of the scene, a preset, or a law without parts. Throws
  /// std::invalid_argument if the law is unknown, or cannot be used with this device.
  const Scene& scene_of(const std::string& law);
  /// The parts of the limiter, separated by spaces, or "none".
  std::string parts_of(const std::string& law);
  /// Throws std::invalid_argument if the network is not valid.
  void add_network(const std::string& network);
  /// Length of a trace, empty for other networks.
  std::optional<Duration> length_of(const std::string& network) const;
  const Scene& scene() const noexcept { return scene_; }

  /// Runs a cell whose law and network have been added. The result only depends on the cell, the scene and `length`.
  /// Thread-safe: yes.
  Measured run(const GridCell& cell, Duration length) const;

 private:
  struct Path {
    simulation::Network::Weather weather{};
    std::optional<injector::Trace> trace{};  ///< instead of the weather
  };
  std::filesystem::path file_;
  std::string text_;
  Scene scene_;
  std::map<std::string, Scene> laws_;
  std::map<std::string, Path> networks_;
};

}  // namespace tendon::lab
