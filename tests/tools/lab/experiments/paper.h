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

/// Lee & Lee 2009, section III, with an environment that no sampled loop can display exactly. Table IV of the paper is
/// lost. `assumed` names the values that replace it (core/PROOFS.md, "Paper's experiments").
struct PaperExperiment {
  std::string name;  ///< "A" … "E", "12", "14"
  std::string what;
  std::string assumed;                ///< values missing in the source
  std::string better;                 ///< features used by AOL+ that the paper's limiter lacks
  std::optional<double> k_op{};       ///< N/m, operational stiffness in the paper
  std::optional<double> k_op_most{};  ///< upper end, if the paper gives a range
  Environment environment;            ///< for `none` and `aol`
  Environment uncontrolled;           ///< unstable without control, according to the paper
  Environment improved;               ///< for `aol+`
  std::optional<OutputEstimator::Config> estimator{};
  Duration period = std::chrono::milliseconds(1);  ///< loop period with `none` and `aol`; `aol+` always has 1 ms
};

const std::vector<PaperExperiment>& paper_experiments();

/// Reproduces all five operational stiffnesses of the paper (core/PROOFS.md, "Paper's experiments"). It does not imply
/// the friction of any device.
inline constexpr Friction kPaperFriction{.coulomb = 0.005, .viscous = 0.26};
inline constexpr double kPaperMaxForce = 8.5;   ///< N
inline constexpr double kPaperEncoder = 30e-6;  ///< m, resolution of the device with the free hand

/// Default parts of AOL+ in a scene for this device: cap, robust ledger, knee.
AolPlus<1, 3>::Parts default_parts(double encoder_step);
/// For a device with very little damping, also bounded acceleration (core/PROOFS.md, "Bounded acceleration").
AolPlus<1, 3>::Parts low_friction_parts(double encoder_step);
/// low_friction_parts() if 2b/T is below the stiffness of common objects.
AolPlus<1, 3>::Parts parts_without_preset(const Friction& friction, double encoder_step);

/// 15 mm · sin(2π · 0.25 Hz · t) along `direction`, independent of forces.
PrescribedMotion paper_motion(const Friction& friction, double encoder_step, const Vec3& direction = Vec3::UnitX());
/// The same motion as the target of a compliant hand: 75 g of device, 50 g of hand, 400 N/m, 0.3 N·s/m.
FreeHand paper_hand(const Friction& friction, const Vec3& direction = Vec3::UnitX());

/// Stiffness displayed on the prescribed motion, stability with the free hand.
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
  std::optional<std::filesystem::path> out{};  ///< folder for paper.csv and the figures
  std::string command{};                       ///< repeats the run
  bool json = false;
  /// Four rows for each experiment, then the rows of Tables II and III. With `from`, the motions of the figures are
  /// simulated again, because lines do not contain them.
  Part part{};
};

/// Throws std::runtime_error if writing fails.
void paper(const PaperOptions& options, std::ostream& out);

}  // namespace tendon::lab
