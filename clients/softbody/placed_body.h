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

/// A body at its place in a scene. Converts between the device frame and the body frame.
class PlacedBody {
 public:
  /// Throws std::invalid_argument if the scene describes no valid body.
  explicit PlacedBody(const Scene& scene) : PlacedBody(scene, Body(scene.body)) {}
  /// With a body that was built before.
  PlacedBody(const Scene& scene, Body body);

  /// Force on the hand at `position` (m, device frame; handle not rotated) or at `handle`. All vectors are in the
  /// device frame. Advances a body with time by one step.
  Feel touch(const Vec3& position) { return touch(Pose{.position = position}); }
  Feel touch(const Pose& handle);

  /// The answer to the server: stiffness and its valid radius, the solver's error and, unless the tool sticks, the
  /// surface. If turns_the_hand(), also the torque, and the angular stiffness if the device measures its orientation;
  /// otherwise the handle counts as not rotated. With Scene::table, also the force at other depths; the table starts at
  /// the surface, or half its depth above the tool if that is deeper.
  ///
  /// A body with time moves the tool from the previous hand position to this one in as many steps as fit between the
  /// samples; if none fits, the previous answer is repeated. After more than kMostBehind, or if the server's clock went
  /// back, it takes a single step: pauses are not caught up. Scene times count from the sample of the first answer.
  Touch answer(const DeviceState& hand);
  static constexpr Duration kMostBehind = std::chrono::milliseconds(200);

  /// Answers to all hands of the scene, in scene order, from one solution. An absent hand (empty state) gets an empty
  /// answer (Touch::unknown).
  std::vector<Touch> answer(std::span<const std::optional<DeviceState>> hands);

  void prepare_by(Background background) { body_.prepare_by(std::move(background)); }

  std::optional<NearModel::Size> near_field() const { return body_.near_field(); }
  std::vector<Ladder::Step> ladder() const { return body_.ladder(); }
  double linear_up_to() const { return body_.linear_up_to(); }
  double deepest() const noexcept { return deepest_; }  ///< m, greatest tool depth so far

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
    Duration owed;  ///< time still to simulate, less than one step
    Feel feel;
  };

  Body body_;
  Mat3 to_device_;
  Vec3 origin_;                ///< body frame origin in the device frame
  std::vector<Vec3> origins_;  ///< origin_ for each of several hands
  Vec3 normal_;                ///< towards the hand
  bool only_pushes_;
  bool turns_;                     ///< turns_the_hand()
  double depths_;                  ///< m, depth range of the force table
  std::optional<PeerTime> first_;  ///< sample time of the first answer; for bodies with a clock
  std::optional<Followed> followed_;
  double deepest_ = 0;
};

}  // namespace tendon::softbody
