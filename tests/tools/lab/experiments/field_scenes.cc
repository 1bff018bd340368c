// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/field_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/base/rotation.h"
#include "tests/support/dice.h"

namespace tendon::lab {
namespace {

constexpr double kTableStep = 1e-3;  // m

double wave(double hertz, double t) { return std::sin(2 * std::numbers::pi * hertz * t); }
double cosine(double hertz, double t) { return std::cos(2 * std::numbers::pi * hertz * t); }

/// Returns 0 until `begin` and 1 after `end`. The speed does not jump.
double eased(double begin, double end, double t) {
  const double share = std::clamp((t - begin) / (end - begin), 0.0, 1.0);
  return share * share * (3 - 2 * share);
}

field::Material described(const TrueMaterial& truth) {
  return {.stiffness = truth.stiffness, .branch = truth.branch, .tau = truth.tau, .friction = truth.friction};
}

FieldScene wall() {
  const Vec3 normal = Vec3(0.31, 0.17, 1).normalized();
  FieldScene scene{
      .name = "wall", .low = {-0.03, -0.03, -0.02}, .high = {0.03, 0.03, 0.02}, .truth = {.stiffness = 2000}};
  scene.exact.primitives = {{.shape = field::Plane{.normal = normal}}};
  scene.target = [normal](double t, const FieldHand& hand) {
    const double f = hand.pace;
    const double along = 0.005 - 0.015 * hand.amplitude * (1 - cosine(0.5 * f, t));
    return Vec3(along * normal + Vec3(0.008 * wave(0.23 * f, t), 0.006 * wave(0.31 * f, t), 0));
  };
  return scene;
}

FieldScene sphere() {
  FieldScene scene{
      .name = "sphere", .low = Vec3::Constant(-0.034), .high = Vec3::Constant(0.034), .truth = {.friction = 0.4}};
  scene.exact.primitives = {{.shape = field::Sphere{.radius = 0.03}}};
  scene.target = [](double t, const FieldHand& hand) {
    const double a = hand.amplitude;
    return Vec3(0.018 * a * wave(0.4 * hand.pace, t), 0.012 * a * wave(0.27 * hand.pace, t),
                0.034 - 0.014 * eased(0.2, 0.8, t));
  };
  return scene;
}

FieldScene bowl() {
  FieldScene scene{
      .name = "bowl", .low = Vec3::Constant(-0.046), .high = {0.046, 0.046, 0.012}, .truth = {.friction = 0.15}};
  scene.exact.primitives = {{.shape = field::Sphere{.radius = 0.04}, .hollow = true}};
  scene.target = [](double t, const FieldHand& hand) {
    const double radius = 0.034 * hand.amplitude * eased(0, 1, t);
    return Vec3(radius * cosine(0.7 * hand.pace, t), radius * wave(0.7 * hand.pace, t),
                -0.030 + 0.004 * wave(0.9 * hand.pace, t));
  };
  return scene;
}

/// 3 mm wide.
FieldScene slot() {
  const Vec3 across = Vec3(1, 0.2, 0).normalized();
  FieldScene scene{.name = "slot",
                   .low = {-0.012, -0.02, -0.008},
                   .high = {0.012, 0.02, 0.008},
                   .truth = {.stiffness = 1500, .friction = 0.1}};
  scene.exact.primitives = {{.shape = field::Plane{.at = 0.0015 * across, .normal = -across}},
                            {.shape = field::Plane{.at = -0.0015 * across, .normal = across}}};
  scene.target = [](double t, const FieldHand& hand) {
    const double y = 0.012 * wave(0.2 * hand.pace, t);
    return Vec3(-0.2 * y + 0.009 * hand.amplitude * wave(0.8 * hand.pace, t), y, 0.003 * wave(0.3, t));
  };
  return scene;
}

/// The engine describes the relaxation. It describes the hardening only if `tabled` is true, in a table.
FieldScene liver(bool tabled) {
  FieldScene scene{.name = tabled ? "liver-table" : "liver",
                   .low = {-0.03, -0.03, -0.012},
                   .high = {0.03, 0.03, 0.008},
                   .truth = {.stiffness = 150, .hardening = 3e4, .branch = 200, .tau = 0.2, .friction = 0.2}};
  scene.exact.primitives = {{.shape = field::Sphere{.centre = {0, 0, -0.08}, .radius = 0.08}}};
  scene.described = described(scene.truth);
  scene.described.stiffness = 250;
  if (tabled) {
    std::array<double, field::DepthTable::kKnots> corrections{};
    for (std::size_t i = 0; i < corrections.size(); ++i) {
      const double depth = kTableStep * static_cast<double>(i + 1);
      corrections[i] = scene.truth.force(depth, depth) - scene.described.stiffness * depth;
    }
    scene.described.table = field::DepthTable::of(kTableStep, corrections);
  }
  scene.target = [](double t, const FieldHand& hand) {
    return Vec3(0.006 * wave(0.3 * hand.pace, t), 0, 0.006 - 0.012 * hand.amplitude * (1 - cosine(0.6 * hand.pace, t)));
  };
  return scene;
}

/// A cube of 40 mm. The hand circles it and crosses its edges. If `inside` is true, the cube is a hole, and the hand
/// follows its edges into the corners.
FieldScene cube(bool inside) {
  FieldScene scene{.name = inside ? "corner" : "edge",
                   .low = Vec3::Constant(-0.03),
                   .high = Vec3::Constant(0.03),
                   .truth = {.friction = 0.2}};
  if (inside) {
    for (const Vec3& n : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
      for (const double side : {-0.02, 0.02}) {
        scene.exact.primitives.push_back({.shape = field::Plane{.at = side * n, .normal = side < 0 ? n : Vec3(-n)}});
      }
    }
  } else {
    scene.exact.primitives = {{.shape = field::Box{.half = Vec3::Constant(0.02)}}};
  }
  scene.target = [inside](double t, const FieldHand& hand) {
    const double since = hand.pace * std::max(t - 0.5, 0.0);  // the hand first presses on a face
    const Vec3 way(cosine(0.41, since), wave(0.41, since), 0.9 * std::sin(2 * std::numbers::pi * 0.17 * since + 0.3));
    const double depth = 0.008 * hand.amplitude - 0.012 * (1 - eased(0.1, 0.5, t));
    return Vec3(way * ((inside ? 0.02 + depth : 0.02 - depth) / way.cwiseAbs().maxCoeff()));
  };
  return scene;
}

/// A box that moves down by 40 mm and back every 2.4 s, at 0.2 m/s. It also rotates. The hand presses on it from above.
FieldScene moving() {
  FieldScene scene{
      .name = "moving", .low = {-0.034, -0.034, -0.014}, .high = {0.034, 0.034, 0.014}, .truth = {.friction = 0.2}};
  scene.exact.primitives = {{.shape = field::Box{.half = {0.03, 0.03, 0.01}, .rounding = 0.002}}};
  scene.pose = [](double t) {
    constexpr double kSpeed = 0.2;
    constexpr double kRise = 0.05;  // s, to the speed and back to rest
    const auto way = [=](double since) {
      const double up = std::clamp(since, 0.0, kRise);
      const double even = std::clamp(since - kRise, 0.0, 0.2 - kRise);
      const double down = std::clamp(since - 0.2, 0.0, kRise);
      return kSpeed * (up * up / (2 * kRise) + even + down - down * down / (2 * kRise));
    };
    const double cycle = std::fmod(t, 2.4);
    return field::Pose{.position = {0, 0, -0.01 - way(cycle - 0.6) + way(cycle - 1.5)},
                       .turn = rotation_by({0, 0.25 * wave(0.4, t), 0})};
  };
  scene.target = [](double t, const FieldHand& hand) {
    return Vec3(0.008 * wave(0.3 * hand.pace, t), 0.005 * wave(0.4 * hand.pace, t),
                0.004 - 0.014 * hand.amplitude * eased(0, 0.5, t));
  };
  return scene;
}

}  // namespace

double TrueMaterial::rest(double dent) const {
  if (!(dent > 0) || branch == 0) return 0;
  const double spring = stiffness + branch;
  if (hardening == 0) return branch * dent / spring;
  return (std::sqrt(spring * spring + 4 * hardening * branch * dent) - spring) / (2 * hardening);
}

double TrueMaterial::force(double depth, double dent) const {
  if (depth <= rest(dent)) return 0;
  return (stiffness + hardening * depth) * depth + branch * (depth - dent);
}

FieldHand field_hand(std::uint64_t seed) {
  Dice dice(seed);
  FieldHand hand;
  hand.body.stiffness *= dice.within(0.7, 1.3);
  hand.body.damping *= dice.within(0.7, 1.3);
  hand.body.mass *= dice.within(0.7, 1.3);
  hand.amplitude = dice.within(0.85, 1.15);
  hand.pace = dice.within(0.85, 1.15);
  return hand;
}

Vec3 FieldScene::speed_at(double t, const FieldHand& hand) const {
  constexpr double kHalf = 5e-4;
  return (target(t + kHalf, hand) - target(t - kHalf, hand)) / (2 * kHalf);
}

const std::vector<FieldScene>& field_scenes() {
  static const std::vector<FieldScene> scenes = [] {
    std::vector<FieldScene> all;
    for (FieldScene scene :
         {wall(), sphere(), bowl(), slot(), liver(false), liver(true), cube(false), cube(true), moving()}) {
      if (scene.truth.hardening == 0) scene.described = described(scene.truth);
      all.push_back(std::move(scene));
    }
    return all;
  }();
  return scenes;
}

Vec3 TrueContact::force(const field::Pose& pose, const Vec3& hand, double elapsed, int rounds) {
  const Vec3 x = pose.to_object(hand);
  if (pushes_.empty()) {
    place_ = x;
    pushes_.assign(scene_.exact.primitives.size(), Vec3::Zero());
  }
  if (scene_.truth.branch > 0) {
    const double stretched = std::max((place_ - x).norm(), scene_.truth.rest(dent_));
    dent_ += (stretched - dent_) * (1 - std::exp(-elapsed / scene_.truth.tau));
  }
  const Vec3 from = place_;
  place_ = std::accumulate(pushes_.begin(), pushes_.end(), x);
  for (int round = 0; round < rounds; ++round) {
    double change = 0;
    for (std::size_t i = 0; i < pushes_.size(); ++i) {
      const field::SurfacePoint here = field::distance(scene_.exact.primitives[i], place_);
      const Vec3& n = here.gradient;
      const double normal = std::max(pushes_[i].dot(n) - here.distance, 0.0);
      Vec3 along = pushes_[i] - (place_ - from);
      along -= along.dot(n) * n;
      const double most = scene_.truth.friction * normal;
      if (along.norm() > most) along *= most / along.norm();
      const Vec3 push = normal * n + along;
      change = std::max(change, (push - pushes_[i]).norm());
      place_ += push - pushes_[i];
      pushes_[i] = push;
    }
    if (change < 1e-10) break;
  }
  const Vec3 pulled = place_ - x;
  depth_ = pulled.norm();
  const field::SurfacePoint nearest = scene_.exact.at(touching() ? place_ : x);
  gap_ = touching() ? -pulled.dot(nearest.gradient) : nearest.distance;
  normal_ = rotated(pose.turn, nearest.gradient);
  if (!touching()) return Vec3::Zero();
  return rotated(pose.turn, pulled * (scene_.truth.force(depth_, dent_) / depth_));
}

std::vector<Vec3> true_forces(const FieldScene& scene, FieldHand hand, int milliseconds) {
  TrueContact contact(scene);
  hand.body.x = scene.target(0, hand);
  std::vector<Vec3> forces;
  for (int ms = 0; ms < milliseconds; ++ms) {
    const Vec3 target = scene.target(ms * 1e-3, hand);
    const Vec3 speed = scene.speed_at(ms * 1e-3, hand);
    for (int i = 0; i < field::Body::kSteps; ++i) {
      const double later = i * field::Body::kStep;
      const Vec3 force = contact.force(scene.pose_at(ms * 1e-3 + later), hand.body.x, field::Body::kStep, 4);
      if (i == 0) forces.push_back(force);
      hand.body.step(force, target + later * speed, speed);
    }
  }
  return forces;
}

}  // namespace tendon::lab
