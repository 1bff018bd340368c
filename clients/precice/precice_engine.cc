// SPDX-License-Identifier: Apache-2.0
#include "clients/precice/precice_engine.h"

#include <precice/precice.hpp>
#include <stdexcept>
#include <vector>

namespace tendon::precice_worker {

struct PreciceEngine::Coupling {
  explicit Coupling(const Config& config) : participant(config.participant, config.file, 0, 1) {}
  precice::Participant participant;
  std::vector<precice::VertexID> nodes{};
  std::vector<double> forces{};
};

PreciceEngine::PreciceEngine(const Config& config)
    : config_(config), patch_(config.patch), coupling_(std::make_unique<Coupling>(config)) {
  precice::Participant& participant = coupling_->participant;
  if (participant.getMeshDimensions(config.mesh) != 3) {
    throw std::invalid_argument("mesh " + config.mesh + ": expected three dimensions");
  }
  coupling_->nodes.resize(patch_.nodes());
  coupling_->forces.resize(patch_.places().size());
  participant.setMeshVertices(config.mesh, patch_.places(), coupling_->nodes);
  if (participant.requiresInitialData()) {
    participant.writeData(config.mesh, config.displacement, coupling_->nodes,
                          std::vector<double>(patch_.places().size(), 0.0));
  }
  participant.initialize();
}

PreciceEngine::~PreciceEngine() = default;

Touch PreciceEngine::answer(const DeviceState& hand) {
  precice::Participant& participant = coupling_->participant;
  if (!participant.isCouplingOngoing()) {
    throw std::runtime_error("the coupling has ended because of max-time or max-time-windows in " + config_.file);
  }
  participant.writeData(config_.mesh, config_.displacement, coupling_->nodes, patch_.displacements(hand));
  participant.advance(participant.getMaxTimeStepSize());
  participant.readData(config_.mesh, config_.force, coupling_->nodes, 0.0, coupling_->forces);
  return patch_.answer(hand, coupling_->forces);
}

}  // namespace tendon::precice_worker
