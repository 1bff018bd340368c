// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/field/field_pose.h"
#include "core/haptic_controller.h"
#include "core/remote/remote_force.h"
#include "tests/tools/lab/experiments/field_run.h"

// The engine and the evaluation of run_field.
namespace tendon::lab {

inline constexpr double kFieldEngineHz = 60;

inline bool has_field(const FieldCase& of) { return of.method >= FieldMethod::kField; }

HapticController::Config field_control(const FieldCase& of);

/// A state that the engine has received. Time 0 is the start of the motion.
struct FieldState {
  std::uint64_t tick = 0;  ///< 1 is the first step
  double sampled = 0;      ///< s
  Vec3 hand = Vec3::Zero();
};

/// The data that the engine computes for a state.
struct FieldAnswer {
  Vec3 force = Vec3::Zero();  ///< N
  LocalModel model{};
  field::TimedPose pose{};  ///< of the object; `at` is from the start of the motion
};

class FieldEngine {
 public:
  explicit FieldEngine(const FieldCase& of) : of_(of), contact_(*of.scene) {}

  FieldAnswer answer(double now, const FieldState& state);

 private:
  field::TimedPose pose_for(double t) const;

  const FieldCase& of_;
  TrueContact contact_;
};

/// Compares the forces with the true forces, and computes the energy account.
class FieldScore {
 public:
  FieldScore(const FieldCase& of, const std::vector<Vec3>& truth) : of_(of), truth_(truth) {}

  /// Must be called once per ms, with the true position of the hand and the force that is applied until the next call.
  void book(const Vec3& hand, const Vec3& force, const std::optional<FieldStep>& field);
  /// Must be called instead of `book` after the start of the motion.
  void add(const Vec3& hand, const Vec3& force, const std::optional<FieldStep>& field);
  FieldRun result() const;

 private:
  const FieldCase& of_;
  const std::vector<Vec3>& truth_;
  FieldRun run_{};
  std::size_t step_ = 0;
  std::optional<Vec3> last_{};
  Vec3 held_ = Vec3::Zero();
  double energy_ = 0;  ///< J
  double wrong_[2] = {0, 0};
  double all_[2] = {0, 0};
};

}  // namespace tendon::lab
