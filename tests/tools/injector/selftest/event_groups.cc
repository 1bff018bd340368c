// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/selftest/evidence.h"
#include "tests/tools/injector/selftest/groups.h"
#include "tests/tools/injector/selftest/traffic.h"

namespace tendon::injector {

using std::chrono::milliseconds;

namespace {

bool in_window(Duration t, Duration first, Duration every, Duration lasts) {
  return t >= first && (t - first) % every < lasts;
}

}  // namespace

std::vector<Check> events(const SelftestOptions& options) {
  std::vector<Check> checks;
  // A period at which no datagram arrives exactly at an event.
  const Traffic traffic{.period = Duration(1'000'003)};
  /// Maximum deviation of the delay from a function of the arrival, in ns.
  const auto worst = [&](const std::string& line, const std::function<double(double)>& expected_ms) {
    double most = 0;
    play(parse_profile(line), traffic, options, [&](std::size_t, const Decision& decision) {
      const double expected = expected_ms(ns(decision.arrival - kStart) / kMs) * kMs;
      most = std::max(most, std::abs(ns(delay(decision)) - expected));
    });
    checks.push_back({line, "largest error of the delay, ns", most, 1});
  };
  worst("base=10ms step(at=300ms,20ms) step(at=700ms,-15ms) order=free",
        [](double t) { return 10 + (t >= 300 ? 20 : 0) - (t >= 700 ? 15 : 0); });
  worst("base=40ms ramp(from=200ms,to=700ms,30ms) ramp(from=800ms,to=900ms,-60ms) order=free", [](double t) {
    return 40 + 30 * std::clamp((t - 200) / 500, 0.0, 1.0) - 60 * std::clamp((t - 800) / 100, 0.0, 1.0);
  });
  worst("base=10ms spike(every=150ms,for=7ms,80ms) order=free",
        [](double t) { return t >= 150 && std::fmod(t, 150) < 7 ? 90 : 10; });
  worst("base=10ms spike(at=20ms,every=150ms,for=7ms,80ms) order=free",
        [](double t) { return t >= 20 && std::fmod(t - 20, 150) < 7 ? 90 : 10; });
  worst("base=10ms stall(every=200ms,for=50ms)", [](double t) {
    const double leaves = t + 10;
    const double within = std::fmod(leaves, 200);
    return leaves >= 200 && within < 50 ? 60 - within : 10;
  });

  struct Absence {
    const char* line;
    Duration first, every, lasts;
  };
  for (const Absence& absence :
       {Absence{"outage(every=150ms,for=7ms)", milliseconds(150), milliseconds(150), milliseconds(7)},
        Absence{"outage(at=500ms,for=100ms)", milliseconds(500), Duration::max(), milliseconds(100)},
        Absence{"outage(at=20ms,every=150ms,for=7ms)", milliseconds(20), milliseconds(150), milliseconds(7)},
        Absence{"handover(every=150ms,for=7ms,5ms)", milliseconds(150), milliseconds(150), milliseconds(7)}}) {
    std::size_t off = 0;
    play(parse_profile(absence.line), traffic, options, [&](std::size_t, const Decision& decision) {
      const bool gone = in_window(decision.arrival - kStart, absence.first, absence.every, absence.lasts);
      off += lost(decision) == gone ? 0U : 1U;
    });
    checks.push_back(none(absence.line, "losses at another time", off));
  }

  // The interval is much shorter than an outage.
  const std::string random_outage = "outage(clear=20ms,for=uniform(1ms,11ms))";
  const Duration period = std::chrono::microseconds(20);
  std::vector<double> lengths;
  std::size_t uneven = 0;
  Duration begun{};
  Duration ended{};
  play(parse_profile(random_outage), {.period = period}, options, [&](std::size_t, const Decision& decision) {
    const Duration now = decision.arrival - kStart;
    if (lost(decision) && begun <= ended) {
      begun = now;
      uneven +=
          ns(begun - ended - milliseconds(20)) > ns(period) || begun - ended < milliseconds(20) - period ? 1U : 0U;
    } else if (!lost(decision) && begun > ended) {
      ended = now;
      lengths.push_back(ns(ended - begun));
    }
  });
  checks.push_back(none(random_outage, "times between outages that differ from 20 ms", uneven));
  checks.push_back(kolmogorov(random_outage, "lengths, Kolmogorov", lengths,
                              [](double x) { return std::clamp((x - 1 * kMs) / (10 * kMs), 0.0, 1.0); }));

  const std::string handover = "base=20ms handover(every=20ms,for=2ms,5ms) order=free";
  std::vector<double> levels;
  std::size_t moved = 0;
  std::int64_t epoch = 0;
  Duration level = milliseconds(20);
  play(parse_profile(handover), traffic, options, [&](std::size_t, const Decision& decision) {
    if (lost(decision)) return;
    const auto now = (decision.arrival - kStart) / milliseconds(20);
    if (now != epoch) {
      epoch = now;
      level = delay(decision);
      levels.push_back(ns(level));
    }
    moved += delay(decision) == level ? 0U : 1U;
  });
  checks.push_back(none(handover, "changes between handovers", moved));
  checks.push_back(kolmogorov(handover, "levels, Kolmogorov", levels,
                              [](double x) { return std::clamp((x - 15 * kMs) / (10 * kMs), 0.0, 1.0); }));
  return checks;
}

}  // namespace tendon::injector
