// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/profiles.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <sstream>
#include <utility>

namespace tendon {
namespace {

using enum Provenance;

constexpr std::string_view kDiolaiti = "Diolaiti et al., IEEE T-RO 22(2), 2006, device table";
constexpr std::string_view kPhantomSheet = "SensAble PHANToM Premium 1.0/1.5 data sheet";
constexpr std::string_view kTouchSheet = "Geomagic/3D Systems Touch data sheet";

/// This is longer than the delays in a loop that works (0.2 ms at p99 without realtime priority, periods of up to 2 ms
/// in our own tests). If the hand moves at 1 m/s, the force is ended after 5 mm.
constexpr KnownNumber kAssumedWatchdog = {0.005, kAssumed, "5 haptic periods at 1 kHz; not documented"};

constexpr std::array kProfiles = {
    DeviceProfile{
        .name = "phantom-premium",
        .mass = {0.075, kRecalled, kPhantomSheet},
        .viscous_friction = {0.005, kRecalled, kDiolaiti},
        .coulomb_friction = {0.04, kRecalled, kPhantomSheet},
        .encoder_step = {0.03e-3, kRecalled, kPhantomSheet},
        .max_force = {8.5, kRecalled, kPhantomSheet},
        .amplifier_bandwidth = {500, kAssumed, "upper end of the 200-500 Hz usual in device models"},
        .watchdog = kAssumedWatchdog,
        .viscous_bound = {0.005, kAssumed, "the value itself: nothing smaller is known"},
        .coulomb_bound = {0.03, kAssumed, "three quarters of the value"},
    },
    DeviceProfile{
        .name = "touch",
        .mass = {0.045, kRecalled, kTouchSheet},
        .viscous_friction = {0.01, kAssumed, "unknown; twice that of the phantom-premium"},
        .coulomb_friction = {0.26, kRecalled, kTouchSheet},
        .encoder_step = {0.055e-3, kRecalled, kTouchSheet},
        .max_force = {3.3, kQuoted, "read back from the device's driver by user code"},
        .amplifier_bandwidth = {300, kAssumed, "middle of 200-500 Hz"},
        .watchdog = kAssumedWatchdog,
        .viscous_bound = {0.005, kAssumed, "half the value, which is itself assumed"},
        .coulomb_bound = {0.195, kAssumed, "three quarters of the value"},
    },
    DeviceProfile{
        .name = "falcon",
        .mass = {0.2, kAssumed, "middle of 0.15-0.25 kg; see Martin and Hillier, ACRA 2009"},
        .viscous_friction = {1.0, kAssumed, "unknown; start value"},
        .coulomb_friction = {0.4, kAssumed, "middle of 0.3-0.5 N"},
        .encoder_step = {0.043e-3, kQuoted, "computed at the centre from libnifalcon's geometry and gears"},
        .max_force = {8.0, kQuoted, "CHAI3D, device specification"},
        .amplifier_bandwidth = {200, kAssumed, "lower end of 200-500 Hz"},
        .watchdog = std::nullopt,  // none is documented
        .viscous_bound = {0.5, kAssumed, "half the value, which is itself assumed"},
        .coulomb_bound = {0.3, kAssumed, "lower end of 0.3-0.5 N"},
    },
};

constexpr std::string_view kHajian = "Hajian and Howe, J. Biomech. Eng. 119:109, 1997, pressing with 2-20 N";
constexpr std::string_view kGrip =
    "Hasser and Cutkosky 2002; Kuchenbecker, Park and Niemeyer, IMECE 2003; grows with the grip";
constexpr std::string_view kArm =
    "Mussa-Ivaldi, Hogan and Bizzi 1985; Dolan et al., IEEE SMC 23, 1993; Tsuji et al. 1995";

constexpr std::array kOperators = {
    OperatorProfile{
        .name = "fingertip",
        .stiffness = {255, 1255, kRecalled, kHajian},
        .damping = {4, 7.4, kRecalled, kHajian},
        .mass = {0.005, 0.006, kRecalled, kHajian},
    },
    OperatorProfile{
        .name = "stylus",
        .stiffness = {100, 600, kRecalled, kGrip},
        .damping = {2, 5, kRecalled, kGrip},
        .mass = {0.03, 0.1, kRecalled, kGrip},
    },
    OperatorProfile{
        .name = "arm",
        .stiffness = {100, 500, kRecalled, kArm},
        .damping = {5, 30, kRecalled, kArm},
        .mass = {0.8, 2.5, kRecalled, kArm},
    },
};

template <class Known>
void add_line(std::ostream& table, std::string_view what, const std::string& value, const Known& number) {
  table << "  " << std::left << std::setw(28) << what << std::setw(15) << value << std::setw(10)
        << to_string(number.provenance) << number.note << '\n';
}

}  // namespace

std::string_view to_string(Provenance provenance) noexcept {
  switch (provenance) {
    case kMeasured:
      return "measured";
    case kQuoted:
      return "quoted";
    case kRecalled:
      return "recalled";
    case kAssumed:
      return "assumed";
  }
  return "?";
}

SimulatedDevice::Config DeviceProfile::device() const {
  SimulatedDevice::Config config;
  config.name = name;
  config.mass = mass.value;
  config.viscous_friction = viscous_friction.value;
  config.coulomb_friction = coulomb_friction.value;
  config.encoder_step = encoder_step.value;
  config.max_force = max_force.value;
  config.amplifier_bandwidth = amplifier_bandwidth.value;
  if (watchdog) config.watchdog = from_seconds(watchdog->value);
  return config;
}

std::span<const DeviceProfile> device_profiles() noexcept { return kProfiles; }

const DeviceProfile* find_device_profile(std::string_view name) noexcept {
  const auto* const found = std::find_if(kProfiles.begin(), kProfiles.end(),
                                         [name](const DeviceProfile& profile) { return profile.name == name; });
  return found == kProfiles.end() ? nullptr : found;
}

OperatorHand::Config OperatorProfile::hand(ScriptedMotion motion) const {
  return {
      .stiffness = stiffness.middle(), .damping = damping.middle(), .mass = mass.middle(), .motion = std::move(motion)};
}

std::span<const OperatorProfile> operator_profiles() noexcept { return kOperators; }

const OperatorProfile* find_operator_profile(std::string_view name) noexcept {
  const auto* const found = std::find_if(kOperators.begin(), kOperators.end(),
                                         [name](const OperatorProfile& profile) { return profile.name == name; });
  return found == kOperators.end() ? nullptr : found;
}

SimulatedDevice::Config admittance_device() {
  SimulatedDevice::Config config;
  config.name = "admittance";
  config.mass = 2;
  config.viscous_friction = 20;
  config.coulomb_friction = 1;
  config.force_sensor.emplace();
  return config;
}

std::string provenance_table(const DeviceProfile& profile) {
  std::ostringstream table;
  const auto line = [&table](std::string_view what, const KnownNumber& number, std::string_view unit) {
    std::ostringstream value;
    value << number.value << ' ' << unit;
    add_line(table, what, value.str(), number);
  };
  table << profile.name << '\n';
  line("apparent mass", profile.mass, "kg");
  line("viscous friction", profile.viscous_friction, "N s/m");
  line("Coulomb friction", profile.coulomb_friction, "N");
  line("encoder count", profile.encoder_step, "m");
  line("largest force", profile.max_force, "N");
  line("amplifier bandwidth", profile.amplifier_bandwidth, "Hz");
  if (profile.watchdog) line("watchdog", *profile.watchdog, "s");
  line("viscous friction, at least", profile.viscous_bound, "N s/m");
  line("Coulomb friction, at least", profile.coulomb_bound, "N");
  return table.str();
}

std::string provenance_table(const OperatorProfile& profile) {
  std::ostringstream table;
  const auto line = [&table](std::string_view what, const KnownRange& range, std::string_view unit) {
    std::ostringstream value;
    value << range.least << '-' << range.most << ' ' << unit;
    add_line(table, what, value.str(), range);
  };
  table << profile.name << " (an operator)\n";
  line("stiffness", profile.stiffness, "N/m");
  line("damping", profile.damping, "N s/m");
  line("mass", profile.mass, "kg");
  return table.str();
}

}  // namespace tendon
