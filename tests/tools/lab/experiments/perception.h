// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "core/base/motion.h"

namespace tendon::lab {

// For the same rms velocity, a vibration at 200 Hz is three times as far above the threshold as a vibration at 20 Hz.

/// Detection threshold (m, peak amplitude) of a sine of this frequency (Hz, > 0):
///
///     f ≤ 40 Hz       3.9 µm
///     40 … 250 Hz     3.9 µm (40 Hz / f)²        12 dB an octave, to 0.1 µm at 250 Hz
///     beyond          0.1 µm (f / 250 Hz)²       our assumption: the same slope upwards
///
/// Source: contactors of 2.9 cm² and more on the thenar eminence (Verrillo, JASA 35, 1963, 1962; corners and slope:
/// Gescheider and Verrillo in Kenshalo, Sensory Functions of the Skin of Humans, 1979, 183), including the level, −20
/// dB of 1 µm at 250 Hz. For a cylinder in the whole hand, thresholds down to 0.01 µm around 150 to 200 Hz were found
/// (Brisben, Hsiao and Johnson, J. Neurophysiol. 81, 1999, 1548). Another level adds the same number of dB to every
/// law.
double detection_threshold(double frequency) noexcept;

inline constexpr double kNothing = -60;  ///< dB
/// Level of a vibration above the detection threshold, dB: the powers of the spectral lines, each relative to its
/// threshold, add up:
///
///     10 log₁₀ Σ_f (x̂_f / detection_threshold(f))²,   x̂_f the amplitude (m) of the displacement; 10 Hz ≤ f
///
/// `velocity`: m/s, one per `period`, without the intended motion (fast_velocity of experiment.h). Returns kNothing for
/// a negligible vibration or less than four values.
double sensation_level(std::span<const Vec3> velocity, Duration period);

/// Weber fractions, noticed in half of the trials. Force: 7 % between 2.5 and 10 N (Pang, Tan and Durlach, Perception &
/// Psychophysics 49, 1991, 531). Stiffness: 23 % (Jones and Hunter, Experimental Brain Research 79, 1990, 150).
inline constexpr double kForceWeber = 0.07;
inline constexpr double kStiffnessWeber = 0.23;
/// N: smaller forces are not judged, because their Weber fraction is larger.
inline constexpr double kLeastJudged = 0.5;

inline bool notices(const Vec3& felt, const Vec3& truth) noexcept {
  return truth.norm() >= kLeastJudged && (felt - truth).norm() > kForceWeber * truth.norm();
}

inline bool notices_stiffness(double shown, double truth) noexcept {
  return !(shown >= (1 - kStiffnessWeber) * truth && shown <= (1 + kStiffnessWeber) * truth);
}

}  // namespace tendon::lab
