// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/solid.h"
#include "tests/tools/lab/experiments/meter.h"
#include "tests/tools/lab/models/compared.h"

namespace tendon::lab {

/// A body in this process, or a worker (clients/cpp/worker/README.md) in other processes. Positions and forces are in
/// the body's frame. Thread-safe: no.
class PressedEngine {
 public:
  virtual ~PressedEngine() = default;
  PressedEngine(const PressedEngine&) = delete;
  PressedEngine& operator=(const PressedEngine&) = delete;

  virtual softbody::Feel touch(const softbody::Vec3& tool) = 0;
  /// Returns the answer of the centered patch at rest under a load (N).
  virtual softbody::Reaction under(double load) = 0;
  virtual double step() const = 0;  ///< s, the simulated time of an answer, or 0 if the body is static
  virtual softbody::Body::Size size() const = 0;
  /// Seconds of an answer: processor time of this process, or wall time for a worker.
  virtual double took(const Meter::Reading& cost) const = 0;

 protected:
  PressedEngine() = default;
};

/// Throws the exceptions of Body.
std::unique_ptr<PressedEngine> own_engine(const softbody::BodyConfig& config);

/// See compared::PressedBody for arguments and exceptions.
std::unique_ptr<PressedEngine> compared_engine(softbody::compared::Kind kind, softbody::Solid solid,
                                               double patch_radius, const softbody::Vec3& middle,
                                               const softbody::compared::Config& config);

/// Creates an engine that asks the worker started by `command`, to which the path of a scene with the model `linear` is
/// appended. Throws std::runtime_error if it does not start or does not answer for ten minutes.
std::unique_ptr<PressedEngine> worker_engine(const softbody::BodyConfig& block, const std::string& command);

}  // namespace tendon::lab
