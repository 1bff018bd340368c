// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/motion.h"
#include "core/field/energy_gate.h"
#include "tests/tools/lab/experiments/field_scenes.h"

namespace tendon::lab {

/// The data that the engine sends. The names are those of FIELDS.md.
enum class FieldMethod : std::uint8_t {
  kHeld,     ///< the force. The limiter is `aol`
  kPlane,    ///< the force, the plane of the contact, the stiffness and a table. The limiter is `feel`
  kField,    ///< a field with a spacing of 1 mm. The limiter is `feel`
  kLearned,  ///< the same, and true forces. The limiter is `feel`
};
std::string_view to_string(FieldMethod method);

struct FieldCase {
  const FieldScene* scene = nullptr;
  FieldMethod method = FieldMethod::kField;
  std::string network = "delay=0ms";  ///< of the injector, both ways
  double loss = 0.05;                 ///< of the answers, in addition
  std::uint64_t seed = 1;             ///< used for the hand and the network
  int milliseconds = 6000;
  double count = 0;                  ///< m, of the encoders; 0: exact
  field::EnergyGate::Config push{};  ///< the tank
  bool ahead = true;                 ///< if true, each pose is the one at the time when it arrives
};

struct FieldRun {
  double error = 0;           ///< rms error divided by the rms of the true force, starting at 0.5 s
  double late_error = 0;      ///< the same, starting at 3 s
  double jump = 0;            ///< N, the maximum change in 1 ms, starting at 0.5 s
  double true_jump = 0;       ///< N in 1 ms
  double least_energy = 0;    ///< J, the minimum of the true account, including the energy of the tank
  double bound = 0;           ///< fraction of the steps in which the gate refuses energy
  double tank = 0;            ///< J, the energy that is taken from the tank
  std::vector<Vec3> force{};  ///< N, at each ms
};

/// The whole server in virtual time with a device of 150 g (b 0.26 N·s/m, f_c 0.02 N) in a hand, and a ForceClient at
/// 60 Hz, which knows the exact shape and gets the states at 1 kHz. The field is uploaded over the network. The hand
/// starts when the server renders it. `truth` is from true_forces for this scene and hand. Throws std::invalid_argument
/// if the network is not known, and std::runtime_error if there is no force within a minute.
FieldRun run_field(const FieldCase& of, const std::vector<Vec3>& truth);

}  // namespace tendon::lab
