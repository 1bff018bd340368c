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

/// What answers when a block is pressed: a body of this process, or a worker (clients/cpp/worker/README.md) that other
/// processes are. Places and forces are in the body's frame. Thread-safe: no.
class PressedEngine {
 public:
  virtual ~PressedEngine() = default;
  PressedEngine(const PressedEngine&) = delete;
  PressedEngine& operator=(const PressedEngine&) = delete;

  virtual softbody::Feel touch(const softbody::Vec3& tool) = 0;
  /// What the patch in the middle answers under a load (N), at rest.
  virtual softbody::Reaction under(double load) = 0;
  virtual double step() const = 0;  ///< s, of the body's own time, that an answer lasts; 0: it has none
  virtual softbody::Body::Size size() const = 0;
  /// s, of what a meter has read, that the answer took: the processor's time of this process, or on the wall.
  virtual double took(const Meter::Reading& cost) const = 0;

 protected:
  PressedEngine() = default;
};

/// The body that `config` describes, in this process. Throws what Body throws.
std::unique_ptr<PressedEngine> own_engine(const softbody::BodyConfig& config);

/// Creates an engine with a comparison model. See compared::PressedBody for the arguments and the exceptions.
std::unique_ptr<PressedEngine> compared_engine(softbody::compared::Kind kind, softbody::Solid solid,
                                               double patch_radius, const softbody::Vec3& middle,
                                               const softbody::compared::Config& config);

/// The same block, as the worker that `command` starts answers for it: the path of a scene with the model `linear` is
/// appended to the command. Throws std::runtime_error when it does not start, or gives no answer for ten minutes.
std::unique_ptr<PressedEngine> worker_engine(const softbody::BodyConfig& block, const std::string& command);

}  // namespace tendon::lab
