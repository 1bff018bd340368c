// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/named_profiles.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "core/base/nearest_word.h"

namespace tendon::injector {
namespace {

// Each profile names the source of its numbers; the others are marked as assumed. Published quantiles come from sparse
// probes; denser datagrams have longer delays, because FIFO order holds some back. The duration of a delay (memory) is
// never published: it is chosen so that the median delay at 1 kHz is less than twice the published one.
constexpr std::array<NamedProfile, 8> kProfiles = {{
    // Round trips of 0.46 ms (median), 0.65 ms (99 %), 2.5 ms (maximum) between two hosts on one Ethernet, 5 per
    // second, over an hour; half of it each way.
    {"lan", "two hosts on one switched Ethernet", "base=0.17ms delay=gamma(0.065ms,0.035ms) memory=10ms",
     "base=0.17ms delay=gamma(0.065ms,0.035ms) memory=10ms"},

    // Round trips of 2.5 ms (median), 62 ms (99 %), 402 ms (maximum) over one good Wi-Fi hop, 5 per second; half of it
    // each way: lognormal through median and 99 %. Loss is assumed, and low because of retransmission in 802.11.
    {"wifi-good", "one Wi-Fi hop, near the access point",
     "base=0.4ms delay=lognormal(2.6ms,7.5ms) memory=2s loss=burst(0.05%,2)",
     "base=0.4ms delay=lognormal(2.6ms,7.5ms) memory=2s loss=burst(0.05%,2)"},

    // Sui et al., "Characterizing and improving WiFi latency in large-scale operational networks", MobiSys 2016: round
    // trips of 47 000 devices on a campus of 3 ms (median), 20 ms (90 %), 250 ms (99 %); half of it each way, linear in
    // between. Assumed: the loss, and the spike of a client that scans other channels.
    {"wifi-bad", "one Wi-Fi hop of a crowded campus",
     "delay=histogram(0.5ms:50,1.5ms:40,10ms:9,125ms:1) memory=5s spike(every=60s,for=100ms,60ms) loss=burst(1%,4)",
     "delay=histogram(0.5ms:50,1.5ms:40,10ms:9,125ms:1) memory=5s spike(every=60s,for=100ms,60ms) loss=burst(1%,4)"},

    // Fitted by mean and standard deviation to one-way delays of 32-byte UDP every 7 ms over low-latency
    // millimeter-wave 5G: DETERMINISTIC6G measurement data (PD-Wireless-5G-3a), see Ansari et al., "Performance of 5G
    // trials for industrial automation", Electronics 11(3):412, 2022. The client has the radio. No losses, as in the
    // data.
    {"5g-urllc", "5G millimetre wave, set up for low latency", "base=0.27ms delay=gamma(0.417ms,0.098ms) memory=10ms",
     "base=0.4ms delay=lognormal(0.376ms,0.123ms) memory=10ms"},

    // Fitted like 5g-urllc to 100-byte PROFINET every 10 ms over mid-band 5G (PD-Wireless-5G-2a).
    {"5g-midband", "5G mid-band on a factory floor", "base=4.65ms delay=gamma(1.871ms,1.003ms) memory=50ms",
     "base=4.35ms delay=lognormal(1.345ms,1.507ms) memory=50ms"},

    // Lauridsen et al., "From LTE to 5G for connected mobility", IEEE Communications Magazine 55(3), 2017: 19 000 km of
    // drive tests; each handover interrupts for 40 ms (median). The handover interval (a cell of 400 m at 80 km/h), the
    // delays (longer up, because the phone requests a grant before it sends) and the loss are assumed.
    {"lte-driving", "LTE in a moving car",
     "base=15ms delay=lognormal(15ms,15ms) memory=2s handover(every=18s,for=40ms,5ms) loss=burst(0.2%,4)",
     "base=12ms delay=lognormal(10ms,12ms) memory=2s handover(every=18s,for=40ms,5ms) loss=burst(0.2%,4)"},

    // arXiv:2601.08439 (Aalborg, 500 one-way probes per second over Starlink): cycles of 15 s, with higher latency in
    // the last 75 ms and the first 140 ms of each. Michel et al., "A first look at Starlink performance", IMC 2022:
    // round trips from Belgium to European servers of 50 ms (median), 40 to 60 ms (quartiles), 20 ms (minimum). Kassem
    // et al., "A browser-side view of Starlink connectivity", IMC 2022: losses coincide with handovers. Assumed:
    // handovers of 20 ms, the extra latency at the boundaries, and the division into up and down.
    {"leo-satellite", "low earth orbit, like Starlink",
     "base=10ms delay=gamma(17ms,6ms) memory=1s spike(at=14.925s,every=15s,for=215ms,25ms) "
     "handover(every=15s,for=20ms,5ms) loss=burst(0.3%,3)",
     "base=10ms delay=gamma(12ms,4ms) memory=1s spike(at=14.925s,every=15s,for=215ms,15ms) "
     "handover(every=15s,for=20ms,5ms) loss=burst(0.3%,3)"},

    // Reinheimer, "Miles per millisecond: a look at the WonderProxy network", 2011: 176 ms round trip between Paris and
    // Fremont, California. Jitter and loss of a backbone are assumed.
    {"wan-intercontinental", "fibre between Europe and the west of North America",
     "base=87.5ms delay=gamma(0.5ms,0.5ms) memory=100ms loss=burst(0.1%,2)",
     "base=87.5ms delay=gamma(0.5ms,0.5ms) memory=100ms loss=burst(0.1%,2)"},
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
      throw std::invalid_argument("the profile starts with \"" + std::string(word) + "\", expected one of the names " +
                                  names_of_profiles() + ", or a line like \"delay=20ms loss=2%\"" +
                                  did_you_mean(word, names_of_profiles()));
    }
    return parse_profile(text);
  }
  return parse_profile(text.substr(end), parse_profile(direction == Direction::kUp ? named->up : named->down));
}

}  // namespace tendon::injector
