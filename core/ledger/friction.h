// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// **Lower bounds** of the friction of a device, isotropic in its base frame. The energy ledger is only credited with
/// the work of the hand and with this friction. If a value is larger than the true friction, the passivity theorem does
/// not hold: an adversarial motion can extract 7.6 mJ if the viscous friction is only half of this value
/// (core/PROOFS.md, "Energy ledger"). If a value is too small, this only makes contacts softer. Subtract any friction
/// or gravity compensation by the driver.
struct Friction {
  double coulomb = 0;  ///< f_c, N
  double viscous = 0;  ///< b, N·s/m
};

}  // namespace tendon
