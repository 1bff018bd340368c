// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/placed_body.h"

#include <Eigen/Geometry>

namespace tendon::softbody {

PlacedBody::PlacedBody(const Scene& scene)
    : body_(scene.body),
      to_device_(Eigen::Quaterniond::FromTwoVectors(body_.normal(), scene.towards_hand).toRotationMatrix()),
      origin_(scene.at - to_device_ * body_.touch_point()) {}

Feel PlacedBody::touch(const Vec3& position) {
  Feel feel = body_.touch(to_device_.transpose() * (position - origin_));
  feel.force = to_device_ * feel.force;
  feel.stiffness = to_device_ * feel.stiffness * to_device_.transpose();
  return feel;
}

Touch PlacedBody::answer(const DeviceState& hand) {
  const Feel feel = touch(hand.position);
  Touch touch = feel.force;
  touch.stiffness = feel.stiffness;
  return touch;
}

}  // namespace tendon::softbody
