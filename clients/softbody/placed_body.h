// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "clients/cpp/field/field.h"
#include "clients/cpp/force_client.h"
#include "clients/softbody/scene.h"

namespace tendon::softbody {

/// Converts between the frame of the device and the frame of the body.
class PlacedBody {
 public:
  /// Throws std::invalid_argument if the scene describes no valid body.
  explicit PlacedBody(const Scene& scene) : PlacedBody(scene, Body(scene.body)) {}
  PlacedBody(const Scene& scene, Body body);

  /// Returns the force on the hand in the frame of the device. If the body has time, this is one step.
  Feel touch(const Vec3& position) { return touch(Pose{.position = position}); }
  Feel touch(const Pose& handle);

  /// Returns the answer for the server, with the torque if turns_the_hand(), the angular stiffness if the device
  /// measures the orientation of the handle, and the force at several depths if Scene::table is set, from the surface
  /// or from half of the table's depth above a deeper tool. If the body has time, the tool moves from the previous
  /// position to this one in steps. If no step fits between the samples, the previous answer is repeated. After a pause
  /// of more than kMostBehind, there is only one step.
  Touch answer(const DeviceState& hand);
  static constexpr Duration kMostBehind = std::chrono::milliseconds(200);

  /// Answers all hands of the scene. An absent hand has an empty state and an empty answer.
  std::vector<Touch> answer(std::span<const std::optional<DeviceState>> hands);

  /// Returns the shape at rest as a field for ForceClient::use, in the frame of the device. The shape is larger by the
  /// radius of the tool. Throws std::invalid_argument as field_of().
  Field field(const Scene::Upload& upload) const;

  void prepare_by(Background background) { body_.prepare_by(std::move(background)); }

  std::optional<NearModel::Size> near_field() const { return body_.near_field(); }
  std::vector<FallbackModel::Step> fallbacks() const { return body_.fallbacks(); }
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
    Duration owed;  ///< time that is not yet simulated, less than a step
    Feel feel;
  };

  Body body_;
  Mat3 to_device_;
  Vec3 origin_;  ///< in the device frame
  std::vector<Vec3> origins_;
  Vec3 normal_;
  bool only_pushes_;
  bool turns_;
  double tool_;                    ///< m, distance from the handle at which the tool touches
  double depths_;                  ///< m, depth range of the force table
  std::optional<PeerTime> first_;  ///< time of the first sample
  std::optional<Followed> followed_;
  double deepest_ = 0;
};

}  // namespace tendon::softbody
