// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "clients/precice/touched_patch.h"

namespace tendon::precice_worker {

/// The hand as a participant of a preCICE coupling: it provides the mesh of a TouchedPatch, writes the nodes'
/// displacements and reads the forces that it takes to hold them there. One time window for each answer, one step in it.
///
/// The coupling scheme must be serial-explicit with the hand first: then the force that is read is the partner's answer
/// to the displacement just written. With a parallel one it would be the answer to the hand before, and would be sent as
/// that to this hand (README.md).
///
/// Thread-safe: no. Realtime-safe: no (it waits for the partner).
class PreciceEngine {
 public:
  struct Config {
    std::string file;  ///< preCICE's own configuration
    std::string participant = "Hand";
    std::string mesh = "Hand-Mesh";
    std::string displacement = "Displacement";
    std::string force = "Force";
    TouchedPatch::Config patch{};
  };

  /// Waits for the partner. Throws std::invalid_argument for a patch that is impossible; preCICE's own errors (an
  /// unknown mesh, …) are std::runtime_error with its sentence.
  explicit PreciceEngine(const Config& config);
  ~PreciceEngine();
  PreciceEngine(const PreciceEngine&) = delete;
  PreciceEngine& operator=(const PreciceEngine&) = delete;

  /// Throws std::runtime_error when the coupling has come to its end, and as preCICE does.
  Touch answer(const DeviceState& hand);

 private:
  struct Coupling;
  Config config_;
  TouchedPatch patch_;
  std::unique_ptr<Coupling> coupling_;
};

}  // namespace tendon::precice_worker
