// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace tendon::replay::testing {

/// Taps through x = 0 twice a second. Settings of a limiter can be appended.
inline constexpr std::string_view kTapping = R"([device]
kind = "simulated"
profile = "falcon"
[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05
[device.hand.motion]
kind = "sine"
amplitude_mm = 15
frequency_hz = 2
)";

}  // namespace tendon::replay::testing
