// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "clients/softbody/touch/rigid_contact.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/touch/ways.h"

namespace tendon::softbody::testing {

inline constexpr double kExact = 1e-11;  // relative to the force

inline std::vector<HeldTool> one(const RigidShape& shape, const Vec3& offset = Vec3::Zero()) {
  return {{shape, offset}};
}

inline RigidContact::Config config_of(const Material& material, double friction = 0, double tolerance = 1e-6) {
  RigidContact::Config config;
  config.tolerance = tolerance;
  config.layer = {.young = material.young, .friction = friction, .shear = material.mu(), .piece = 0.001};
  return config;
}

struct PressedByTools {
  PressedByTools(Law law, std::vector<HeldTool> tools, double friction = 0, double tolerance = 1e-6)
      : solid(pressed_block(Element::kHex8Sri, 8, 0.45, law)),
        top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius),
        model(solid, top, {}),
        contact(model, solid, top, std::move(tools), config_of(solid.material(), friction, tolerance)) {}

  Feel at(const Pose& handle) { return contact.press(std::vector{std::optional(handle)}).front(); }
  Feel at(const Vec3& place) { return at(Pose{.position = place}); }

  Solid solid;
  TouchSurface top;
  QuasiStaticModel model;
  RigidContact contact;
};

/// −∂(force, torque)/∂(place, rotation) by central differences.
inline Layer::Mat6 slopes(PressedByTools& pressed, const Pose& handle) {
  constexpr double kStep = 2e-6;  // m, rad
  Layer::Mat6 all;
  const auto felt = [&](int axis, double way) {
    Pose there = handle;
    if (axis < 3)
      there.position += way * Vec3::Unit(axis);
    else
      there.turn = Eigen::AngleAxisd(way, Vec3::Unit(axis - 3)).toRotationMatrix() * there.turn;
    const Feel feel = pressed.at(there);
    return (Layer::Vec6() << feel.force, feel.torque->torque).finished();
  };
  for (int axis = 0; axis < 6; ++axis) all.col(axis) = (felt(axis, -kStep) - felt(axis, kStep)) / (2 * kStep);
  return all;
}

inline Vec3 support(const PressedByTools& pressed) {
  const VectorXd force = pressed.solid.forces(pressed.model.displacements()).force;
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < pressed.solid.size(); ++i) {
    if (pressed.solid.free_of(i) < 0) sum[i % 3] += force[i];
  }
  return sum;
}

struct RubbedWay : ClosedWay {
  double lost = 0;
  double least = 0;  ///< smallest loss of a friction point in one answer
};
template <class Handle>
RubbedWay closed_way(PressedByTools& pressed, const Handle& handle, int steps) {
  double lost = 0;
  double least = 0;
  const ClosedWay way = closed_way(handle, steps, [&](const Pose& pose) {
    Feel feel = pressed.at(pose);
    lost += pressed.contact.dissipated().sum;
    least = std::min(least, pressed.contact.dissipated().least);
    return feel;
  });
  return {way, lost, least};
}

}  // namespace tendon::softbody::testing
