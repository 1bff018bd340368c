// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "clients/softbody/scene.h"

namespace tendon::softbody {

/// A body in its place in a scene. It converts between the device's frame and the body's own.
class PlacedBody {
 public:
  /// Throws std::invalid_argument when the scene describes no possible body.
  explicit PlacedBody(const Scene& scene) : PlacedBody(scene, Body(scene.body)) {}
  /// The same with its body made already.
  PlacedBody(const Scene& scene, Body body);

  /// The force on the hand at `position` (m, device frame) with the handle not turned, or at `handle`; all vectors are
  /// in the device frame. A body with time advances by one step.
  Feel touch(const Vec3& position) { return touch(Pose{.position = position}); }
  Feel touch(const Pose& handle);

  /// The same as an answer to the server. It has the stiffness and how far that holds, the solver's error and, unless
  /// the tool sticks, the surface. Where turns_the_hand() it has the torque, and the angular stiffness when the device
  /// measures its handle's orientation; when it does not, the handle counts as not turned. With Scene::table it has the
  /// force at other depths too: the table begins at the surface, or half a table's depth above the tool where that is
  /// deeper.
  ///
  /// A body with time moves the tool from the hand's last position to this one, in the steps that fit between the two
  /// samples; when none fits, the last answer is repeated. After more than `kMostBehind`, or when the server's clock is
  /// set back, it takes a single step: a pause is not caught up. The times that a scene plans count from the sample of
  /// the first answer.
  Touch answer(const DeviceState& hand);
  static constexpr Duration kMostBehind = std::chrono::milliseconds(200);

  /// The answers to all hands of the scene at once, by their order there: one solution, each the answer to its own
  /// state. Empty: that hand is nowhere, and so is its answer (Touch::unknown).
  std::vector<Touch> answer(std::span<const std::optional<DeviceState>> hands);

  /// See Body.
  void prepare_by(Background background) { body_.prepare_by(std::move(background)); }

  std::optional<NearModel::Size> near_field() const { return body_.near_field(); }  ///< see Body
  std::vector<Ladder::Step> ladder() const { return body_.ladder(); }               ///< see Body
  double linear_up_to() const { return body_.linear_up_to(); }                      ///< see Body
  double deepest() const noexcept { return deepest_; }  ///< m, the greatest depth of the tool so far

 private:
  void tick(PeerTime sampled);
  Feel follow(const DeviceState& hand);
  std::optional<ForceTable> table(const Pose& handle, double gap);
  Pose pose(const DeviceState& hand) const;
  Pose to_body(const Pose& handle, const Vec3& origin) const;
  void turn_to_device(Feel& feel) const;
  Touch touch_of(const Feel& feel, const DeviceState& hand);
  struct Followed {
    PeerTime sampled;
    Pose handle;
    Duration owed;  ///< time still to be simulated, less than a step
    Feel feel;
  };

  Body body_;
  Mat3 to_device_;
  Vec3 origin_;                ///< of the body's frame, in the device's
  std::vector<Vec3> origins_;  ///< the same for each of several hands
  Vec3 normal_;                ///< towards the hand
  bool only_pushes_;
  bool turns_;                     ///< turns_the_hand()
  double depths_;                  ///< m, the depth of the table
  std::optional<PeerTime> first_;  ///< the time of the first sample that was answered; for bodies with a clock
  std::optional<Followed> followed_;
  double deepest_ = 0;
};

}  // namespace tendon::softbody
