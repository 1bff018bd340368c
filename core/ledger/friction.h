// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// **Lower bounds** of the friction of a device, isotropic in its base frame. Besides the work of the hand they are the
/// only income of the energy ledger. Values above the true friction void the passivity theorem: with twice the true
/// viscous friction an adversarial motion draws 7.6 mJ (core/PROOFS.md, "Energy ledger"). Lower values only make
/// contact softer. Subtract any friction or gravity compensation by the driver.
struct Friction {
  double coulomb = 0;  ///< f_c, N
  double viscous = 0;  ///< b, N·s/m
};

}  // namespace tendon
