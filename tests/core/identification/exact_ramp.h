// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "core/identification/ramp_run.h"

namespace tendon::testing {

/// The exact solution of m dv/dt = s t + bias − b v − f_c from rest, with optional rounding by an encoder.
struct ExactRamp {
  double rate = 0.1;  ///< s, N/s, either sign
  double viscous = 0.26;
  double coulomb = 0.05;
  double mass = 0.075;
  double bias = 0;       ///< N, missing from the recorded force
  double travel = 0.25;  ///< m
  double encoder_step = 3e-5;
  double period = 1e-3;
  std::string place = {};

  double position(double t) const {
    const double tau = std::max(t - (coulomb - sign() * bias) / std::abs(rate), 0.0);
    const double lag = mass / viscous;
    return sign() * std::abs(rate) / viscous * (tau * tau / 2 - lag * tau - lag * lag * std::expm1(-tau / lag));
  }

  RampRun run() const {
    RampRun result{place, {}};
    for (int i = 0; std::abs(position(i * period)) <= travel; ++i) {
      const double t = i * period;
      const double x = position(t);
      // The recorded force is the mean of the ramp over the following period.
      result.samples.push_back(
          {t, encoder_step > 0 ? std::round(x / encoder_step) * encoder_step : x, rate * (t + period / 2)});
    }
    return result;
  }

 private:
  double sign() const { return rate > 0 ? 1 : -1; }
};

}  // namespace tendon::testing
