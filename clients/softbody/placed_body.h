// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/cpp/force_client.h"
#include "clients/softbody/scene.h"

namespace tendon::softbody {

/// A body where a scene has put it: between the device's frame and the body's own.
class PlacedBody {
 public:
  /// Throws std::invalid_argument when the scene makes no body.
  explicit PlacedBody(const Scene& scene);

  /// What the hand is to feel at `position` (m, device frame); all vectors in the device frame.
  Feel touch(const Vec3& position);

  /// The same as an answer to the server: force and stiffness.
  Touch answer(const DeviceState& hand);

 private:
  Body body_;
  Mat3 to_device_;
  Vec3 origin_;  ///< of the body's frame, in the device's
};

}  // namespace tendon::softbody
