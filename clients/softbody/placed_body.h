// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>

#include "clients/cpp/force_client.h"
#include "clients/softbody/scene.h"

namespace tendon::softbody {

/// A body where a scene has put it: between the device's frame and the body's own.
class PlacedBody {
 public:
  /// Throws std::invalid_argument when the scene makes no body.
  explicit PlacedBody(const Scene& scene);

  /// The force on the hand at `position` (m, device frame); all vectors in the device frame. A body with time goes
  /// on by one step.
  Feel touch(const Vec3& position);

  /// The same as an answer to the server: with the stiffness and how far it holds, the solver's error and, where a tool
  /// does not stick, the surface; with Scene::table the force at other depths too, from the surface on, or from half of
  /// the table above the tool where that is deeper. A body with time goes on from the hand's last place to
  /// this one, by as many steps as went by between the two samples; when that is none, the answer is the last one.
  /// After more than `kMostBehind`, or when the server's clock is set back, it takes one step instead: a pause is not
  /// made up for. What a scene plans over time counts from the first answer's sample.
  Touch answer(const DeviceState& hand);
  static constexpr Duration kMostBehind = std::chrono::milliseconds(200);

  double linear_up_to() const { return body_.linear_up_to(); }  ///< as Body's
  double deepest() const noexcept { return deepest_; }          ///< m, that the tool has been in the body

 private:
  void tick(PeerTime sampled);
  Feel follow(const DeviceState& hand);
  std::optional<ForceTable> table(const Vec3& position, double gap);
  struct Followed {
    PeerTime sampled;
    Vec3 position;
    Duration owed;  ///< less than a step, that is yet to be simulated
    Feel feel;
  };

  Body body_;
  Mat3 to_device_;
  Vec3 origin_;  ///< of the body's frame, in the device's
  Vec3 normal_;  ///< towards the hand
  bool only_pushes_;
  double depths_;                  ///< m, of the table
  std::optional<PeerTime> first_;  ///< when the hand was where it was answered first; of bodies with a clock
  std::optional<Followed> followed_;
  double deepest_ = 0;
};

}  // namespace tendon::softbody
