// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "core/base/motion.h"

namespace tendon::lab {

// Perceived intensity of vibration. If the rms of the velocity is the same at 20 Hz and at 200 Hz, the second vibration
// is three times as far above the threshold.

/// Returns the detection threshold (m, peak amplitude) of a sine of this frequency (Hz, > 0):
///
///     f ≤ 40 Hz       3.9 µm
///     40 … 250 Hz     3.9 µm (40 Hz / f)²        12 dB an octave, to 0.1 µm at 250 Hz
///     beyond          0.1 µm (f / 250 Hz)²       our assumption: the same slope upwards
///
/// Source: the shape is that of contactors of 2.9 cm² and more on the thenar eminence (Verrillo, JASA 35, 1963, 1962;
/// corners and slope: Gescheider and Verrillo in Kenshalo, Sensory Functions of the Skin of Humans, 1979, 183). The
/// level, −20 dB of 1 µm at 250 Hz, is the value in that source. For a cylinder in the whole hand, thresholds down to
/// 0.01 µm around 150 to 200 Hz were found (Brisben, Hsiao and Johnson, J. Neurophysiol. 81, 1999, 1548). Another level
/// adds the same number of dB to every law and does not affect comparisons.
double detection_threshold(double frequency) noexcept;

inline constexpr double kNothing = -60;  ///< dB
/// Returns the level of a vibration above the detection threshold, dB; kNothing for a negligible one. The powers of the
/// spectral lines, each relative to its threshold, add up:
///
///     10 log₁₀ Σ_f (x̂_f / detection_threshold(f))²,   x̂_f the amplitude (m) of the displacement; 10 Hz ≤ f
///
/// `velocity`: m/s, one per `period`, without the intended motion (fast_velocity of experiment.h). Returns kNothing if
/// there are less than four values.
double sensation_level(std::span<const Vec3> velocity, Duration period);

/// Weber fractions: the smallest relative change that is noticed in half of the trials. Force: 7 % between 2.5 and 10 N
/// (Pang, Tan and Durlach, Perception & Psychophysics 49, 1991, 531). Stiffness: 23 % (Jones and Hunter, Experimental
/// Brain Research 79, 1990, 150).
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
