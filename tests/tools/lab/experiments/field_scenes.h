// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/motion.h"
#include "core/field/field.h"
#include "core/field/field_pose.h"
#include "tests/core/field/body.h"

namespace tendon::lab {

/// The true force of a surface at the depth d. The dent z relaxes with the time constant `tau`:
///     F = k₁ d + k₂ d² + k_m (d − z)          N, at least 0
struct TrueMaterial {
  double stiffness = 1000;  ///< k₁, N/m
  double hardening = 0;     ///< k₂, N/m²
  double branch = 0;        ///< k_m, N/m
  double tau = 0.2;         ///< s
  double friction = 0;

  double force(double depth, double dent) const;
  double rest(double dent) const;  ///< m, where the force is 0
};

/// The parameters of a hand and its motion.
struct FieldHand {
  double amplitude = 1;
  double pace = 1;
  field::Body body{};
};

/// Spring 300 N/m, damper 3 N·s/m and mass 50 g, each ± 30 %; amplitude and pace ± 15 %.
FieldHand field_hand(std::uint64_t seed);

/// An object, its material, and the motion of the hand.
struct FieldScene {
  std::string name;
  field::Field exact{};  ///< of primitives
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();     ///< the bricks are between low and high
  TrueMaterial truth{};         ///< of all surfaces
  field::Material described{};  ///< as the engine describes it
  std::function<Vec3(double t, const FieldHand& hand)> target{};
  std::function<field::Pose(double t)> pose{};  ///< empty: at rest

  field::Pose pose_at(double t) const { return pose ? pose(std::max(t, 0.0)) : field::Pose{}; }
  Vec3 speed_at(double t, const FieldHand& hand) const;  ///< of the target
};

/// wall, sphere, bowl, slot, liver, liver-table, edge, corner, moving
const std::vector<FieldScene>& field_scenes();

/// Computes the true force on a hand. A point p without mass is pulled by the hand x, and pushed by the surface i
/// of the scene with q_i, in units of its displacement: p = x + Σ q_i. For each surface, with the normal n, and p₀ the
/// p of the previous call:
///     q·n ≥ 0, φ(p) ≥ 0, and one of them is 0                      no penetration
///     ‖q_t‖ ≤ μ q·n, and q_t is against p − p₀ or keeps it at 0     Coulomb friction
/// solved by projection, one surface after the other. If the point is in an edge, it is in contact with two surfaces,
/// and there is friction at both. The force is U′(‖p − x‖) along p − x. Source: Alart and Curnier, Computer Methods in
/// Applied Mechanics and Engineering 92(3), 1991.
class TrueContact {
 public:
  explicit TrueContact(const FieldScene& scene) : scene_(scene) {}

  /// Returns the force (N) on a hand at `hand`, `elapsed` s after the previous call.
  Vec3 force(const field::Pose& pose, const Vec3& hand, double elapsed, int rounds);

  bool touching() const { return depth_ > 0; }
  const Vec3& normal() const { return normal_; }  ///< in the base frame, out of the solid
  double gap() const { return gap_; }             ///< m, from the surface to the hand, along the normal
  double force_at(double depth) const { return scene_.truth.force(depth, dent_); }

 private:
  const FieldScene& scene_;
  std::vector<Vec3> pushes_{};  ///< q, m, frame of the object
  Vec3 place_ = Vec3::Zero();   ///< p
  double dent_ = 0;
  double depth_ = 0;
  double gap_ = 0;
  Vec3 normal_ = Vec3::UnitZ();
};

/// Returns the force (N) on the hand for each ms. The simulation runs at 20 kHz and has no network or limiter.
std::vector<Vec3> true_forces(const FieldScene& scene, FieldHand hand, int milliseconds);

}  // namespace tendon::lab
