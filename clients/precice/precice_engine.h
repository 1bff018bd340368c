// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "clients/precice/touched_patch.h"

namespace tendon::precice_worker {

/// The hand as a participant of a preCICE coupling. It provides the mesh of a TouchedPatch, writes the displacements
/// of the nodes, and reads the forces required to hold the nodes there. Each answer is one time window with one step.
///
/// The coupling scheme must be serial-explicit with the hand first, so that the forces answer the displacements just
/// written. A parallel scheme would return forces for the previous displacements (README.md).
///
/// Thread-safe: no. Realtime-safe: no (it waits for the partner).
class PreciceEngine {
 public:
  struct Config {
    std::string file;  ///< the configuration file of preCICE
    std::string participant = "Hand";
    std::string mesh = "Hand-Mesh";
    std::string displacement = "Displacement";
    std::string force = "Force";
    TouchedPatch::Config patch{};
  };

  /// Waits for the partner. Throws std::invalid_argument for an invalid patch, and std::runtime_error for errors
  /// reported by preCICE, for example an unknown mesh.
  explicit PreciceEngine(const Config& config);
  ~PreciceEngine();
  PreciceEngine(const PreciceEngine&) = delete;
  PreciceEngine& operator=(const PreciceEngine&) = delete;

  /// Throws std::runtime_error if the coupling has ended or if there is an error in preCICE.
  Touch answer(const DeviceState& hand);

 private:
  struct Coupling;
  Config config_;
  TouchedPatch patch_;
  std::unique_ptr<Coupling> coupling_;
};

}  // namespace tendon::precice_worker
