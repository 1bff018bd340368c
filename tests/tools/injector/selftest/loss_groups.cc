// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/selftest/evidence.h"
#include "tests/tools/injector/selftest/groups.h"
#include "tests/tools/injector/selftest/traffic.h"

namespace tendon::injector {

using std::chrono::milliseconds;

std::vector<Check> all_losses(const SelftestOptions& options) {
  std::vector<Check> checks;
  append(checks, check_losses("loss=2%", LossChain::bernoulli(0.02), options));
  append(checks, check_losses("loss=30%", LossChain::bernoulli(0.3), options));
  append(checks, check_losses("loss=burst(2%,4)", LossChain::burst(0.02, 4), options));
  append(checks, check_losses("loss=burst(20%,4)", LossChain::burst(0.2, 4), options));
  append(checks, check_losses("loss=burst(10%,20)", LossChain::burst(0.1, 20), options));
  append(checks, check_losses("loss=gilbert(0.01,0.25,1,0)", LossChain::gilbert(0.01, 0.25, 1, 0), options));
  append(checks, check_losses("loss=gilbert(0.02,0.1,0.7,0.01)", LossChain::gilbert(0.02, 0.1, 0.7, 0.01), options));
  append(checks, check_losses("loss=fourstate(0.01,0.3,0.2,0.4,0.005)",
                              LossChain::four_state(0.01, 0.3, 0.2, 0.4, 0.005), options));

  append(checks, check_losses("loss=bursts(pareto2,5%,10%,4.4:1.6,5:0.3)",
                              LossChain::pareto_bursts(0.05, 0.1, {4.4, 5}, {1.6, 0.3}, 40), options));

  const std::string pattern = "0001011";
  std::size_t off = 0;
  play(parse_profile("loss=pattern(" + pattern + ")"), {}, options, [&](std::size_t i, const Decision& decision) {
    off += lost(decision) == (pattern[i % pattern.size()] == '1') ? 0U : 1U;
  });
  checks.push_back(none("loss=pattern(" + pattern + ")", "losses that differ", off));

  const std::string rule = "drop(byte=0,mask=0xf,value=3,40%)";
  std::size_t meant = 0;
  std::size_t hit = 0;
  std::size_t others = 0;
  Traffic typed;
  typed.type = [](std::size_t i) { return static_cast<std::uint8_t>(i % 16 + 16 * (i % 3)); };
  play(parse_profile(rule), typed, options, [&](std::size_t i, const Decision& decision) {
    const bool of_type = i % 16 == 3;
    meant += of_type ? 1U : 0U;
    hit += of_type && lost(decision) ? 1U : 0U;
    others += !of_type && lost(decision) ? 1U : 0U;
  });
  checks.push_back(rate(rule, "loss rate of that type", static_cast<double>(hit), static_cast<double>(meant), 0.4));
  checks.push_back(none(rule, "losses of other types", others));
  return checks;
}

std::vector<Check> separation(const SelftestOptions& options) {
  const std::string line = "delay=gamma(10ms,7ms) loss=burst(20%,3)";
  const auto alone = delays(parse_profile("delay=gamma(10ms,7ms)"), {}, options);
  std::size_t off = 0;
  std::vector<double> of_lost;
  play(parse_profile(line), {}, options,
       [&](std::size_t i, const Decision& decision) { off += ns(delay(decision)) == alone[i] ? 0U : 1U; });
  play(parse_profile(line + " order=free"), {}, options, [&](std::size_t, const Decision& decision) {
    if (lost(decision)) of_lost.push_back(ns(delay(decision)));
  });
  return {none(line, "delays that differ from those without loss", off),
          kolmogorov(line, "delays of lost datagrams, Kolmogorov", of_lost, delay_laws()[6].law)};
}

std::vector<Check> regimes(const SelftestOptions& options) {
  const std::string line =
      "regime(clear,dwell=50ms,delay=1ms) regime(busy,dwell=20ms,delay=2ms,loss=10%) "
      "regime(blocked,dwell=5ms,delay=3ms,loss=burst(60%,5)) order=free loss=1%";
  const std::array dwell_ms = {50.0, 20.0, 5.0};
  std::array<std::vector<bool>, 3> in;
  std::array<std::uint64_t, 3> losses{};
  play(parse_profile(line), {}, options, [&](std::size_t, const Decision& decision) {
    const auto state = static_cast<std::size_t>(delay(decision) / milliseconds(1) - 1);
    for (std::size_t i = 0; i < in.size(); ++i) in[i].push_back(i == state);
    if (lost(decision) && state < 3) ++losses[state];
  });
  std::vector<Check> checks;
  for (std::size_t i = 0; i < in.size(); ++i) {
    std::vector<double> here(in.size());
    here[i] = 1;
    const auto chain = LossChain::regimes({dwell_ms.begin(), dwell_ms.end()}, 1, here);
    append(checks, check_events(line, std::array{"clear", "busy", "blocked"}[i] + std::string(" stay"), in[i], chain));
  }
  const auto share = [&](std::size_t i) { return static_cast<double>(std::ranges::count(in[i], true)); };
  checks.push_back(rate(line, "loss rate while clear", static_cast<double>(losses[0]), share(0), 0.01));
  checks.push_back(rate(line, "loss rate while busy", static_cast<double>(losses[1]), share(1), 0.1));
  checks.push_back(rate(line, "loss rate while blocked", static_cast<double>(losses[2]), share(2), 0.6,
                        LossChain::burst(0.6, 5).variance_factor()));
  return checks;
}

std::vector<Check> check_losses(std::string_view line, const LossChain& chain, const SelftestOptions& options) {
  std::vector<bool> events;
  events.reserve(options.count);
  play(parse_profile(line), {}, options,
       [&](std::size_t, const Decision& decision) { events.push_back(lost(decision)); });
  return check_events(std::string(line), "loss", events, chain);
}

}  // namespace tendon::injector
