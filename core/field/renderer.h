// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "core/field/energy_gate.h"
#include "core/field/field.h"
#include "core/field/field_pose.h"
#include "core/field/proxy.h"
#include "core/field/residual.h"

namespace tendon::field {

/// Renders a field in the haptic thread. The force then does not depend on the delay of the engine.
/// With the hand x, the proxy p, the depth d = ‖p − x‖ and the dent z, in every step in this order:
///     1  E is the account of the limiter after it has booked the interval
///     2  H₀ = ΣU_old(d, z)           old law, old place of p, new hand
///     3  z relaxes at d
///     4  the new pose carries p; the law blends over 50 ms if the field or the material has changed
///     5  p moves (`moved`)
///     6  H ≤ H₀ + min(max(E − H₀, 0), P T) + tank (EnergyGate): otherwise p sinks towards x until it holds, and if
///        U(0, z) is still too large, z shrinks
///     7  F = ΣU′(d)(p − x)/d, and the held rest of the residual; then the limiter must bound the force
/// The order is necessary for the proof (core/field/README.md): E ≥ H ≥ 0 for every motion, shape, swap, pose and
/// parameter, if the sum of all `most_stiffness` is at most 2 b/T. For stiffer fields the limiter clips.
///
/// Against popping, P = 0.2 W for 200 ms after a swap, and as long as this binds: d rises by at most 0.2 m/s · T in a
/// step, and falls by at most as much while the force pushes out of the surface. Otherwise P = ∞. A field that appears
/// under the hand starts with p = x, without a force.
/// Thread-safe: no. Realtime-safe: yes, except the constructor. Uses 100 kB.
class Renderer {
 public:
  static constexpr double kSwapPower = 0.2;  ///< W
  static constexpr double kSwapSpeed = 0.2;  ///< m/s
  static constexpr Duration kSwapTime = std::chrono::milliseconds(200);
  static constexpr double kBlend = 0.05;       ///< s
  static constexpr double kMostPeriod = 0.01;  ///< s, maximum used time of a step

  struct Config {
    double max_stiffness = 1500;  ///< N/m, > 0; maximum slope of a material with its table
    EnergyGate::Config push{};    ///< energy that a moving object can transfer to the hand
    bool learns = true;           ///< true forces teach the tables of the materials (Residual)
    bool holds = true;            ///< the rest of a true force is held
  };

  struct Rendered {
    Vec3 force = Vec3::Zero();      ///< N, on the hand
    Mat3 stiffness = Mat3::Zero();  ///< N/m, along the normal of the contact and to the fixtures
    double stored = 0;              ///< H, J
    double depth = 0;               ///< d, m
    Vec3 proxy = Vec3::Zero();      ///< p, base frame
    double refused = 0;             ///< J that the gate refused in this step
    double credit = 0;      ///< J from the tank, to be credited to the account before the limiter bounds the force
    bool swapping = false;  ///< true while the limits after a swap are used
  };

  /// Throws std::invalid_argument with the name of the field if it is out of range.
  explicit Renderer(const Config& config);

  /// Replaces the field. `field` must be valid and outlive its use. Learned tables are kept if the material and its table
  /// do not change. If the pointer is null, the field is removed, and its pose, tables and true forces are forgotten.
  void use(const Field* field, LocalTime now) noexcept;

  /// Sets p to x in the next step. Must be called if the force was not applied.
  void restart() noexcept { started_ = false; }

  /// Returns H₀ in J if the hand is at `x` in the next step. This is ΣU(d, z) with the law and the position of p of the
  /// last step, or 0 if there is no field.
  double stored(const Vec3& x) const noexcept;

  /// See FieldPose::observe.
  bool observe(const TimedPose& pose) noexcept { return pose_.observe(pose); }

  /// Takes the true force (N) that answers step `tick`. Returns false for a step before the current field, and as
  /// Residual::learn.
  bool observe(std::uint64_t tick, const Vec3& truth, LocalTime now) noexcept;

  /// Performs one step with the finite position `hand` and the account E (J).
  Rendered render(const Motion& hand, double account, std::uint64_t tick) noexcept;

  const Material& material(std::size_t index) const noexcept { return materials_[index]; }

 private:
  /// The spring of a fixture and its p.
  struct Pull {
    Fixture law{};
    Vec3 place = Vec3::Zero();  ///< p in the base frame
  };

  void start(const Pose& pose, const Vec3& x) noexcept;
  void follow_material(double period) noexcept;
  void ease(const Vec3& x, double before, double period, Proxy& proxy) noexcept;
  void render_surface(const Pose& pose, const Vec3& x, double before, double period, Rendered& result) noexcept;
  void render_fixtures(const Pose& pose, const Vec3& x, double period, Rendered& result) noexcept;

  Config config_;
  const Field* field_ = nullptr;
  std::array<Material, Field::kMostMaterials> described_{};  ///< by the engine
  std::array<Material, Field::kMostMaterials> materials_{};  ///< with the learned tables
  std::size_t material_count_ = 0;
  std::array<Pull, Field::kMostFixtures> pulls_{};
  std::size_t pull_count_ = 0;
  FieldPose pose_;
  EnergyGate gate_;
  Residual residual_;

  bool started_ = false;
  LocalTime last_{};
  LocalTime swapped_{};
  std::optional<std::uint64_t> first_tick_{};  ///< of the current field
  bool swapping_ = false;
  bool bound_ = false;         ///< a limit after a swap was binding in this step
  Proxy proxy_{};              ///< in the frame of the object
  Vec3 place_ = Vec3::Zero();  ///< p in the base frame
  double dent_ = 0;            ///< z
  Material law_{};             ///< in force
  Material from_{};            ///< at the start of the blend
  double blend_ = 0;           ///< s, left
  std::uint8_t blends_to_ = 0;
};

}  // namespace tendon::field
