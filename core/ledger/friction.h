// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// **Lower bounds** of a device's own friction, isotropic in the device base frame: the only income of
/// the energy ledger besides the work of the hand.
///
/// Claiming more than the device has voids the passivity theorem (with viscous friction claimed twice
/// too high an adversary draws 7.6 mJ, control.md 2); claiming less only makes contact softer. Net of
/// any friction or gravity compensation of the driver.
struct Friction {
  double coulomb = 0;  ///< f_c, N
  double viscous = 0;  ///< b, N·s/m
};

}  // namespace tendon
