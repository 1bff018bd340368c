// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "core/control/preset.h"
#include "tests/support/swept_work.h"
#include "tests/tools/lab/experiments/experiment.h"

namespace tendon::lab {

/// An experiment of Lee & Lee 2009, section III: an environment that no sampled loop can display as it is.
///
/// Table IV of the paper is lost. `assumed` names the values that replace it (core/PROOFS.md, "Paper's experiments").
struct PaperExperiment {
  std::string name;                   ///< "A" … "E", "12", "14"
  std::string what;                   ///< one line
  std::string assumed;                ///< what the source lost
  std::string better;                 ///< what AOL+ makes use of here and the paper's limiter cannot
  std::optional<double> k_op{};       ///< N/m, operational stiffness in the paper
  std::optional<double> k_op_most{};  ///< … when the paper has a range
  Environment environment;            ///< of `none` and `aol`
  Environment uncontrolled;           ///< what the paper shows to be unstable without control
  Environment improved;               ///< of `aol+`
  std::optional<OutputEstimator::Config> estimator{};
  Duration period = std::chrono::milliseconds(1);  ///< of the loop with `none` and `aol`; `aol+` always has 1 ms
};

const std::vector<PaperExperiment>& paper_experiments();

/// The friction that reproduces all five operational stiffnesses of the paper (core/PROOFS.md, "Paper's experiments"). It
/// is no evidence for the friction of any device.
inline constexpr Friction kPaperFriction{.coulomb = 0.005, .viscous = 0.26};
inline constexpr double kPaperMaxForce = 8.5;   ///< N
inline constexpr double kPaperEncoder = 30e-6;  ///< m, of the device with the free hand

/// AOL+ as a scene for this device has it: cap, robust ledger, knee.
AolPlus<1, 3>::Parts default_parts(double encoder_step);
/// default_parts() and bounded acceleration, for a device with very little damping (core/PROOFS.md, "Bounded
/// acceleration").
AolPlus<1, 3>::Parts low_friction_parts(double encoder_step);
/// The one of these two that this device needs: bounded acceleration where 2b/T is less than what objects are made of.
AolPlus<1, 3>::Parts parts_without_preset(const Friction& friction, double encoder_step);

/// 15 mm · sin(2π · 0.25 Hz · t) along `direction`, whatever the hand feels.
PrescribedMotion paper_motion(const Friction& friction, double encoder_step, const Vec3& direction = Vec3::UnitX());
/// The same motion wanted by a hand that feels: 75 g of device, 50 g of hand, 400 N/m, 0.3 N·s/m.
FreeHand paper_hand(const Friction& friction, const Vec3& direction = Vec3::UnitX());

/// `law` on an experiment: displayed stiffness on the prescribed motion, stability on the free hand.
struct PaperRow {
  std::string experiment;
  std::string law;  ///< none, aol, aol+ or the name of a preset
  std::optional<double> k_op_paper;
  Outcome prescribed;
  Outcome free;
  std::vector<Moment> prescribed_record;
  std::vector<Moment> free_record;

  double least_energy() const;
};

PaperRow paper_row(const PaperExperiment& experiment, Law law, std::optional<Preset> preset = {});

struct PaperOptions {
  std::optional<std::filesystem::path> out{};  ///< folder for the figures
  bool json = false;
  /// Its units are the rows of the table: four for each experiment, then those of Tables II and III. With `from` the
  /// figures' motions are run again: no line has a motion.
  Part part{};
};

/// `tendon-lab paper`: all of it, as a table or JSON and as figures. Throws std::runtime_error when it cannot write.
void paper(const PaperOptions& options, std::ostream& out);

}  // namespace tendon::lab
