// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/named_profiles.h"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace tendon::injector {
namespace {

constexpr std::array<NamedProfile, 8> kProfiles = {{
    {"lan", "switched Ethernet in one building", "base=0.1ms delay=gamma(0.1ms,0.05ms)",
     "base=0.1ms delay=gamma(0.1ms,0.05ms)"},
    {"wifi-good", "one access point, few others", "base=0.8ms delay=lognormal(1ms,2ms) rho=0.5 loss=burst(0.1%,2)",
     "base=0.8ms delay=lognormal(1ms,2ms) rho=0.5 loss=burst(0.1%,2)"},
    {"wifi-bad", "far from the access point, many others",
     "base=1ms delay=lognormal(6ms,20ms) rho=0.9 loss=burst(2%,4)",
     "base=1ms delay=lognormal(6ms,20ms) rho=0.9 loss=burst(2%,4)"},
    {"5g-urllc", "5G millimetre wave, configured for low latency", "base=0.5ms delay=gamma(0.2ms,0.08ms)",
     "base=0.55ms delay=gamma(0.25ms,0.1ms)"},
    {"5g-midband", "5G mid-band, private network", "base=4ms delay=gamma(2ms,0.8ms)",
     "base=3ms delay=gamma(2.3ms,0.7ms)"},
    {"lte-driving", "LTE in a moving car", "base=25ms delay=lognormal(25ms,20ms) memory=200ms loss=burst(0.5%,4)",
     "base=20ms delay=lognormal(15ms,15ms) memory=200ms loss=burst(0.5%,4)"},
    {"leo-satellite", "low earth orbit satellites",
     "base=12ms delay=lognormal(8ms,5ms) memory=20ms handover(every=15s,for=30ms,5ms) loss=burst(1%,4)",
     "base=10ms delay=lognormal(6ms,4ms) memory=20ms handover(every=15s,for=30ms,5ms) loss=burst(0.5%,4)"},
    {"wan-intercontinental", "fibre between Europe and Asia",
     "base=80ms delay=exponential(0ms,0.5ms) loss=burst(0.1%,2)",
     "base=80ms delay=exponential(0ms,0.5ms) loss=burst(0.1%,2)"},
}};

}  // namespace

std::span<const NamedProfile> named_profiles() { return kProfiles; }

std::string names_of_profiles() {
  std::string names;
  for (const NamedProfile& profile : kProfiles) names += (names.empty() ? "" : ", ") + std::string(profile.name);
  return names;
}

Profile resolve_profile(std::string_view text, Direction direction) {
  const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(first);
  const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
  const std::string_view word = text.substr(0, end);
  const auto named = std::ranges::find(kProfiles, word, &NamedProfile::name);
  if (named == kProfiles.end()) {
    if (!word.empty() && word.find_first_of("=(") == std::string_view::npos) {
      throw std::invalid_argument("the profile begins with \"" + std::string(word) + "\", expected one of the names " +
                                  names_of_profiles() + ", or a line like \"delay=20ms loss=2%\"");
    }
    return parse_profile(text);
  }
  return parse_profile(text.substr(end), parse_profile(direction == Direction::kUp ? named->up : named->down));
}

}  // namespace tendon::injector
