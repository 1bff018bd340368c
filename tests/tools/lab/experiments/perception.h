// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "core/base/motion.h"

namespace tendon::lab {

// What a hand notices. An rms is the same for 3 mm/s at 20 Hz and at 200 Hz; a hand feels the second three times as
// far above its threshold.

/// The amplitude (m, peak) of a sine of this frequency (Hz, > 0) that a hand just feels:
///
///     f ≤ 40 Hz       3.9 µm
///     40 … 250 Hz     3.9 µm (40 Hz / f)²        12 dB an octave, to 0.1 µm at 250 Hz
///     beyond          0.1 µm (f / 250 Hz)²       our assumption: as steep upwards
///
/// Source: the shape is that of contactors of 2.9 cm² and more on the thenar eminence (Verrillo, JASA 35, 1963, 1962;
/// its corners and slope: Gescheider and Verrillo in Kenshalo, Sensory Functions of the Skin of Humans, 1979, 183). The
/// level, −20 dB of 1 µm at 250 Hz, is the one quoted from there. A cylinder in the whole hand is felt earlier, by some
/// people at 0.01 µm around 150 to 200 Hz (Brisben, Hsiao and Johnson, J. Neurophysiol. 81, 1999, 1548): another level
/// adds the same number of dB to every law, and changes no comparison.
double detection_threshold(double frequency) noexcept;

inline constexpr double kNothing = -60;  ///< dB
/// How far a vibration is above what a hand just feels, dB: 0 is the threshold, and kNothing dB next to nothing. The parts of the
/// spectrum add up by their power, each over its threshold:
///
///     10 log₁₀ Σ_f (x̂_f / detection_threshold(f))²,   x̂_f the amplitude (m) of the displacement; 10 Hz ≤ f
///
/// `velocity`: m/s, one for each `period`, without the motion that the hand intends (fast_velocity of experiment.h).
/// Less than four values: kNothing.
double sensation_level(std::span<const Vec3> velocity, Duration period);

/// Weber fractions: the smallest change that is told apart in half of the trials, as a share.
/// Force: 7 % between 2.5 and 10 N (Pang, Tan and Durlach, Perception & Psychophysics 49, 1991, 531). Stiffness: 23 %
/// (Jones and Hunter, Experimental Brain Research 79, 1990, 150).
inline constexpr double kForceWeber = 0.07;
inline constexpr double kStiffnessWeber = 0.23;
/// N: smaller forces are not judged; their Weber fraction grows.
inline constexpr double kLeastJudged = 0.5;

/// A hand tells what it feels from what is true; the two forces in N.
inline bool notices(const Vec3& felt, const Vec3& truth) noexcept {
  return truth.norm() >= kLeastJudged && (felt - truth).norm() > kForceWeber * truth.norm();
}

/// A hand tells the stiffness that it is shown (N/m) from the true one (> 0).
inline bool notices_stiffness(double shown, double truth) noexcept {
  return !(shown >= (1 - kStiffnessWeber) * truth && shown <= (1 + kStiffnessWeber) * truth);
}

}  // namespace tendon::lab
