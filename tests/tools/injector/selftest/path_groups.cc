// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <deque>
#include <span>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/selftest/evidence.h"
#include "tests/tools/injector/selftest/groups.h"
#include "tests/tools/injector/selftest/traffic.h"

namespace tendon::injector {

using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {

/// An independent queue of `places` datagrams of equal cost. Returns each departure, or nullopt if it was full.
class FifoQueue {
 public:
  FifoQueue(Duration service, std::size_t places) : service_(service), places_(places) {}
  std::optional<Duration> departure(Duration arrival) {
    while (!leaving_.empty() && leaving_.front() <= arrival) leaving_.pop_front();
    if (leaving_.size() >= places_) return std::nullopt;
    leaving_.push_back(std::max(arrival, leaving_.empty() ? arrival : leaving_.back()) + service_);
    return leaving_.back();
  }

 private:
  Duration service_;
  std::size_t places_;
  std::deque<Duration> leaving_;
};

}  // namespace

std::vector<Check> order(const SelftestOptions& options) {
  std::vector<Check> checks;
  const std::string jitter = "delay=lognormal(20ms,10ms) rho=0.9";
  const auto free = delays(parse_profile(jitter + " order=free"), {}, options);
  std::size_t backwards = 0;
  std::size_t off = 0;
  LocalTime last = LocalTime::min();
  play(parse_profile(jitter), {}, options, [&](std::size_t i, const Decision& decision) {
    backwards += decision.release < last ? 1U : 0U;
    const LocalTime own = decision.arrival + Duration(std::llround(free[i]));
    off += decision.release == std::max(last, own) ? 0U : 1U;
    last = decision.release;
  });
  checks.push_back(none(jitter, "releases before the previous datagram", backwards));
  checks.push_back(none(jitter, "releases that are not max(previous, own)", off));

  const std::string jump = "delay=20ms jump(2%,3)";
  std::size_t jumped = 0;
  std::size_t moved = 0;
  std::size_t elsewhere = 0;
  std::vector<LocalTime> releases;
  play(parse_profile(jump), {}, options, [&](std::size_t i, const Decision& decision) {
    const LocalTime steady = decision.arrival + milliseconds(20);
    if (decision.cause == Cause::kReorder) {
      ++jumped;
      // Ahead of the third before it and behind the fourth.
      if (i >= 4 && !(decision.release <= releases[i - 3] && decision.release >= releases[i - 4])) ++elsewhere;
    } else {
      moved += decision.release == steady ? 0U : 1U;
    }
    releases.push_back(steady);
  });
  checks.push_back(
      rate(jump, "share that jumps", static_cast<double>(jumped), static_cast<double>(options.count), 0.02));
  checks.push_back(none(jump, "jumps to another place", elsewhere));
  checks.push_back(none(jump, "others that were moved", moved));
  return checks;
}

std::vector<Check> copies_and_damage(const SelftestOptions& options) {
  constexpr std::uint32_t kSize = 200;
  std::vector<Check> checks;
  const auto n = static_cast<double>(options.count);

  const std::string twice = "delay=exponential(2ms,8ms) duplicate=10% order=free";
  std::vector<double> second;
  play(parse_profile(twice), {}, options, [&](std::size_t, const Decision& decision) {
    if (decision.duplicate) second.push_back(ns(*decision.duplicate - decision.arrival));
  });
  checks.push_back(rate(twice, "duplicate rate", static_cast<double>(second.size()), n, 0.1));
  // A second copy has its own delay but is never ahead of the first: the maximum of two.
  const Cdf one = delay_laws()[3].law;
  checks.push_back(kolmogorov(twice, "second copies, Kolmogorov", second, [&](double x) { return one(x) * one(x); }));

  const std::string stale = "replay(5%,64)";
  std::vector<std::uint64_t> back(65);
  play(parse_profile(stale), {}, options, [&](std::size_t i, const Decision& decision) {
    if (i >= 64 && decision.stale) ++back[std::min<std::size_t>(decision.stale->back, 64)];
  });
  double replayed = 0;
  for (const auto count : back) replayed += static_cast<double>(count);
  checks.push_back(rate(stale, "replay rate", replayed, n - 64, 0.05));
  checks.push_back(pearson(stale, "how far back", std::span(back).subspan(1), even_shares(64)));

  const auto damage = [&](const std::string& line, const std::string& share, const std::string& place,
                          std::optional<std::uint32_t> Decision::*where, std::size_t places) {
    std::vector<std::uint64_t> counts(places);
    double damaged = 0;
    play(parse_profile(line), {.size = kSize}, options, [&](std::size_t, const Decision& decision) {
      if (!(decision.*where)) return;
      ++damaged;
      ++counts.at(*(decision.*where));
    });
    checks.push_back(rate(line, share, damaged, n, 0.2));
    checks.push_back(pearson(line, place, counts, even_shares(places)));
  };
  damage("flip=20%", "flip rate", "which bit", &Decision::flipped_bit, std::size_t{8} * kSize);
  damage("truncate=20%", "truncation rate", "bytes left", &Decision::truncated_to, kSize);

  const std::string rebind = "rebind(every=10s)";
  std::size_t off = 0;
  play(parse_profile(rebind), {}, options,
       [&](std::size_t i, const Decision& decision) { off += decision.rebinds == i / 10'000 ? 0U : 1U; });
  checks.push_back(none(rebind, "source ports that differ", off));
  return checks;
}

std::vector<Check> bottleneck(const SelftestOptions& options) {
  std::vector<Check> checks;
  const auto n = static_cast<double>(options.count);
  // The transmission of 972 bytes and a header of 28 bytes takes 0.8 ms at 10 Mbit/s.
  constexpr Duration kService = microseconds(800);
  for (const char* const limit : {"queue=20packets", "queue=20kB"}) {
    const std::string line = std::string("rate=10Mbit/s overhead=28 ") + limit;
    Traffic over{.period = Duration(500'003), .size = 972};
    FifoQueue queue(kService, 20);
    std::size_t off = 0;
    std::size_t dropped = 0;
    Duration longest{};
    LocalTime last{};
    play(parse_profile(line), over, options, [&](std::size_t, const Decision& decision) {
      const auto leaves = queue.departure(decision.arrival - kStart);
      off += lost(decision) != !leaves || (leaves && decision.release != kStart + *leaves) ? 1U : 0U;
      if (lost(decision)) {
        ++dropped;
      } else {
        longest = std::max(longest, delay(decision));
        last = decision.release;
      }
    });
    const double load = ns(kService) / ns(over.period);
    const double seconds_busy = seconds(last - kStart);
    checks.push_back(none(line, "decisions that differ from those of a queue", off));
    checks.push_back(
        {line, "drops against 1 - 1/load", std::abs(static_cast<double>(dropped) / n - (1 - 1 / load)), 20 / n});
    checks.push_back({line, "bit/s out against rate, relative",
                      std::abs((n - static_cast<double>(dropped)) * 8000 / seconds_busy / 10e6 - 1), 1e-4});
    checks.push_back(
        {line, "longest wait against 20 services, ns", std::abs(ns(longest - 20 * kService)), ns(over.period)});
  }
  const std::string idle = "rate=10Mbit/s overhead=28";
  std::size_t off = 0;
  play(parse_profile(idle), {.size = 972}, options,
       [&](std::size_t, const Decision& decision) { off += delay(decision) == kService ? 0U : 1U; });
  checks.push_back(none(idle, "waits in a queue that is never full", off));

  // Three opportunities in 10 ms carry 4500 bytes, for 1000-byte datagrams at twice that rate. An opportunity can end
  // within a datagram; the k-th leaves when 1000 (k + 1) bytes have been carried.
  Profile opportunities = parse_profile("overhead=28 queue=20packets");
  opportunities.bottleneck.opportunities_ms = {3, 4, 10};
  const std::string line = "opportunities at 3, 4, 10 ms, queue=20packets";
  std::size_t sent = 0;
  off = 0;
  play(opportunities, {.period = Duration(1'111'111), .size = 972}, options,
       [&](std::size_t, const Decision& decision) {
         if (lost(decision)) return;
         ++sent;
         const Duration since = decision.release - kStart;
         const Duration within = since % milliseconds(10);
         off += within == milliseconds(3) || within == milliseconds(4) || within == Duration{} ? 0U : 1U;
       });
  const double cycles = n * 1'111'111 / 10e6;
  checks.push_back(none(line, "releases at no opportunity", off));
  checks.push_back({line, "bytes out per opportunity against 1500, relative",
                    std::abs(static_cast<double>(sent) * 1000 / (cycles * 3) / 1500 - 1), 30 / (cycles * 4.5)});
  std::size_t late = 0;
  const std::string sparse = "opportunities at 3, 4, 10 ms, one datagram at a time";
  play(opportunities, {.period = Duration(11'111'111), .size = 972}, options,
       [&](std::size_t, const Decision& decision) {
         const Duration since = decision.arrival - kStart;
         const Duration within = since % milliseconds(10);
         const Duration next = within <= milliseconds(3)   ? milliseconds(3)
                               : within <= milliseconds(4) ? milliseconds(4)
                                                           : milliseconds(10);
         late += delay(decision) == next - within ? 0U : 1U;
       });
  checks.push_back(none(sparse, "not at the next opportunity", late));
  return checks;
}

}  // namespace tendon::injector
