// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/selftest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <fstream>
#include <functional>
#include <iomanip>
#include <limits>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "core/base/time.h"
#include "tests/support/json_line.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr double kSignificance = 1e-7;
constexpr std::size_t kFewest = 1000;          // datagrams: below that a check says next to nothing
constexpr std::size_t kLongestRun = 2000;      // told apart; all longer ones are one class
constexpr double kMs = 1e6;                    // ns
constexpr Duration kPeriod = milliseconds(1);  // between datagrams, unless said otherwise

/// How many standard deviations a normal variate exceeds with a probability of kSignificance, either way.
double most_deviations() { return -normal_quantile(kSignificance / 2); }

double ns(Duration d) { return static_cast<double>(d.count()); }

// ---- Traffic --------------------------------------------------------------------------------------------------------

/// Datagrams as the profile meets them.
struct Traffic {
  Duration period = kPeriod;
  std::uint32_t size = 200;
  std::uint32_t link = 0;
  Direction direction = Direction::kUp;
  /// Arrival of datagram i after the start, where they are not evenly spaced.
  std::function<Duration(std::size_t)> at = {};
  /// The first byte of datagram i, for rules by message type.
  std::function<std::uint8_t(std::size_t)> type = {};
};

/// Not zero: an injector that takes absolute times for times since its start would be caught.
constexpr LocalTime kStart{std::chrono::hours(1)};

template <class Visit>
void play(const Profile& profile, const Traffic& traffic, const SelftestOptions& options, Visit visit) {
  Injector injector(profile, options.seed, traffic.link, traffic.direction);
  std::vector<std::byte> payload(traffic.size);
  for (std::size_t i = 0; i < options.count; ++i) {
    const Duration after = traffic.at ? traffic.at(i) : traffic.period * static_cast<std::int64_t>(i);
    if (traffic.type) payload[0] = std::byte{traffic.type(i)};
    visit(i, injector.decide({.arrival = kStart + after, .size = traffic.size, .bytes = payload}));
  }
}

bool lost(const Decision& decision) { return decision.verdict == Verdict::kDrop; }

Duration delay(const Decision& decision) { return decision.release - decision.arrival; }

std::vector<double> delays(const Profile& profile, const Traffic& traffic, const SelftestOptions& options) {
  std::vector<double> result;
  result.reserve(options.count);
  play(profile, traffic, options,
       [&](std::size_t, const Decision& decision) { result.push_back(ns(delay(decision))); });
  return result;
}

// ---- Statistics as checks -------------------------------------------------------------------------------------------

Check kolmogorov(std::string model, std::string what, std::vector<double> samples, const Cdf& law, double independent) {
  std::ranges::sort(samples);
  return {std::move(model), std::move(what), kolmogorov_distance(samples, law),
          kolmogorov_bound(independent, kSignificance)};
}

Check kolmogorov(std::string model, std::string what, const std::vector<double>& samples, const Cdf& law) {
  return kolmogorov(std::move(model), std::move(what), samples, law, static_cast<double>(samples.size()));
}

Check pearson(std::string model, std::string what, std::span<const std::uint64_t> counts,
              std::span<const double> shares) {
  const ChiSquare fit = chi_square(counts, shares);
  return {std::move(model), std::move(what) + ", chi-square of " + std::to_string(fit.freedom), fit.value,
          chi_square_bound(fit.freedom, kSignificance)};
}

/// `happened` of n events of probability p: the deviation of the rate, in absolute terms.
Check rate(std::string model, std::string what, double happened, double n, double p, double variance_factor = 1) {
  const double bound = most_deviations() * std::sqrt(p * (1 - p) * variance_factor / n);
  return {std::move(model), std::move(what), std::abs(happened / n - p), std::max(bound, 1 / n)};
}

Check none(std::string model, std::string what, std::size_t deviations) {
  return {std::move(model), std::move(what), static_cast<double>(deviations), 0};
}

std::vector<double> even_shares(std::size_t cells) {
  return std::vector<double>(cells, 1.0 / static_cast<double>(cells));
}

void append(std::vector<Check>& checks, std::vector<Check> more) {
  checks.insert(checks.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

/// Events that should come as `chain` says: their share and how many follow one another.
std::vector<Check> check_events(const std::string& model, const std::string& what, const std::vector<bool>& events,
                                const LossChain& chain) {
  const auto happened = static_cast<double>(std::ranges::count(events, true));
  return {
      rate(model, what + " rate", happened, static_cast<double>(events.size()), chain.rate(), chain.variance_factor()),
      pearson(model, what + " lengths", run_lengths(events, chain.bursts_to_forget()), chain.bursts(kLongestRun))};
}

// ---- Laws of delays -------------------------------------------------------------------------------------------------

/// A model of delay, as text, and its distribution function in ns.
struct DelayLaw {
  std::string line;
  Cdf law;
  bool continuous = true;
};

std::vector<DelayLaw> delay_laws() {
  const auto gamma_law = [](double mean, double deviation) {
    const double shape = mean * mean / (deviation * deviation);
    return [shape, scale = mean / shape](double x) { return incomplete_gamma(shape, x / scale); };
  };
  const auto lognormal_law = [](double mean, double deviation) {
    const double variance = std::log1p(deviation * deviation / (mean * mean));
    return [mu = std::log(mean) - variance / 2, sigma = std::sqrt(variance)](double x) {
      return x <= 0 ? 0 : normal_cdf((std::log(x) - mu) / sigma);
    };
  };
  return {
      {"delay=uniform(5ms,15ms)", [](double x) { return std::clamp((x - 5 * kMs) / (10 * kMs), 0.0, 1.0); }},
      {"delay=normal(20ms,4ms)", [](double x) { return x < 0 ? 0 : normal_cdf((x - 20 * kMs) / (4 * kMs)); }},
      // Below zero is zero: an atom of 16 % there.
      {"delay=normal(2ms,2ms)", [](double x) { return x < 0 ? 0 : normal_cdf((x - 2 * kMs) / (2 * kMs)); }, false},
      {"delay=exponential(2ms,8ms)", [](double x) { return x < 2 * kMs ? 0 : -std::expm1((2 * kMs - x) / (6 * kMs)); }},
      {"delay=lognormal(20ms,10ms)", lognormal_law(20 * kMs, 10 * kMs)},
      {"delay=pareto(5ms,2.5)", [](double x) { return x < 5 * kMs ? 0 : 1 - std::pow(5 * kMs / x, 2.5); }},
      {"delay=gamma(10ms,7ms)", gamma_law(10 * kMs, 7 * kMs)},
      // A thousandth of it below 100 ns: whole nanoseconds are too coarse to tell the draw from the delay.
      {"delay=gamma(10ms,14ms)", gamma_law(10 * kMs, 14 * kMs), false},
      // Bins of 1 ms: shares 0.1, 0.6, 0, 0.3.
      {"delay=histogram(3ms:1,4ms:6,5ms:0,6ms:3)",
       [](double x) {
         const double ms = x / kMs - 3;
         return 0.1 * std::clamp(ms, 0.0, 1.0) + 0.6 * std::clamp(ms - 1, 0.0, 1.0) +
                0.3 * std::clamp(ms - 3, 0.0, 1.0);
       }},
      {"delay=samples(3ms:1,5ms:6,9ms:3)",
       [](double x) { return x < 3 * kMs   ? 0
                             : x < 5 * kMs ? 0.1
                             : x < 9 * kMs ? 0.7
                                           : 1.0; }, false},
  };
}

/// Innovations of samples that should be a Gaussian copula: independent standard normal variates. rho(t) is that
/// between t − 1 and t.
std::vector<double> innovations(const std::vector<double>& z, const std::function<double(std::size_t)>& rho) {
  std::vector<double> result;
  result.reserve(z.size());
  for (std::size_t t = 1; t < z.size(); ++t)
    result.push_back((z[t] - rho(t) * z[t - 1]) / std::sqrt(1 - rho(t) * rho(t)));
  return result;
}

std::vector<double> normal_scores(std::vector<double> samples, const Cdf& law) {
  for (auto& sample : samples) sample = normal_quantile(std::clamp(law(sample), 1e-9, 1 - 1e-9));
  return samples;
}

std::vector<Check> check_innovations(const std::string& model, const std::vector<double>& independent) {
  const auto n = static_cast<double>(independent.size());
  return {kolmogorov(model, "innovations, Kolmogorov", independent, normal_cdf),
          {model, "innovations, autocorrelation", std::abs(autocorrelation(independent, 1)),
           most_deviations() / std::sqrt(n)}};
}

// ---- Groups of checks -----------------------------------------------------------------------------------------------

std::vector<Check> all_delays(const SelftestOptions& options) {
  std::vector<Check> checks;
  std::size_t off = 0;
  play(parse_profile("base=5ms delay=20ms"), {}, options,
       [&](std::size_t, const Decision& decision) { off += delay(decision) == milliseconds(25) ? 0U : 1U; });
  checks.push_back(none("base=5ms delay=20ms", "delays that differ", off));
  for (const auto& [line, law, continuous] : delay_laws()) {
    for (const double rho : {0.0, 0.5, 0.9, 0.99}) {
      std::ostringstream correlated;
      correlated << line << " order=free";
      if (rho > 0) correlated << " rho=" << rho;
      append(checks, check_delays(correlated.str(), law, rho, continuous, options));
    }
  }
  return checks;
}

/// Correlation by time: ρ = exp(−Δt / memory), for datagrams that come unevenly.
std::vector<Check> memory(const SelftestOptions& options) {
  const std::string line = "delay=lognormal(20ms,10ms) memory=20ms order=free";
  const DelayLaw law = delay_laws()[4];
  const std::array gaps = {0.5, 7.0, 0.1, 30.0, 2.0};  // ms before datagram i, in turn
  const double round = 39.6;
  Traffic traffic;
  traffic.at = [&](std::size_t i) {
    const std::size_t rounds = i / gaps.size();
    double after = round * static_cast<double>(rounds);
    for (std::size_t k = 0; k < i % gaps.size(); ++k) after += gaps[k + 1];
    return microseconds(std::llround(after * 1000));
  };
  const auto z = normal_scores(delays(parse_profile(line), traffic, options), law.law);
  return check_innovations(line, innovations(z, [&](std::size_t t) { return std::exp(-gaps[t % gaps.size()] / 20); }));
}

/// Many links, one datagram each: what begins, begins as if it had always been so, and no link knows of another.
std::vector<Check> first_datagrams(const SelftestOptions& options) {
  const std::string line = "delay=lognormal(20ms,10ms) rho=0.99 loss=gilbert(0.001,0.01,1,0) order=free";
  const Injector any_link(parse_profile(line), options.seed, 0, Direction::kDown);
  std::vector<double> samples;
  std::vector<bool> losses;
  // A hundredth, for an injector costs more than a decision.
  for (std::uint32_t link = 0; link < options.count / 100; ++link) {
    const Decision first = any_link.for_link(link).decide({.arrival = kStart, .size = 200});
    samples.push_back(ns(delay(first)));
    losses.push_back(lost(first));
  }
  const auto n = static_cast<double>(samples.size());
  const auto z = normal_scores(samples, delay_laws()[4].law);
  return {kolmogorov(line, "first datagrams of links, Kolmogorov", samples, delay_laws()[4].law),
          {line, "link against link, correlation", std::abs(autocorrelation(z, 1)), most_deviations() / std::sqrt(n)},
          rate(line, "first datagrams of links, loss rate", static_cast<double>(std::ranges::count(losses, true)), n,
               1.0 / 11)};
}

/// Two streams of delays that should have nothing in common.
std::vector<Check> independence(const SelftestOptions& options) {
  const std::string line = "delay=normal(20ms,4ms) order=free";
  const Profile profile = parse_profile(line);
  const Cdf law = delay_laws()[1].law;
  SelftestOptions other_seed = options;
  ++other_seed.seed;
  const auto ours = normal_scores(delays(profile, {}, options), law);
  const auto check = [&](const std::string& what, const std::vector<double>& others) {
    double products = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) products += ours[i] * others[i];
    const auto n = static_cast<double>(ours.size());
    return Check{line, what, std::abs(products / n), most_deviations() / std::sqrt(n)};
  };
  return {check("up against down, correlation",
                normal_scores(delays(profile, {.direction = Direction::kDown}, options), law)),
          check("link 0 against link 1, correlation", normal_scores(delays(profile, {.link = 1}, options), law)),
          check("seed against next seed, correlation", normal_scores(delays(profile, {}, other_seed), law))};
}

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

/// What lossy profiles do to delays: nothing.
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
          kolmogorov(line, "delays of what is lost, Kolmogorov", of_lost, delay_laws()[6].law)};
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
  // A delay of its own, but never ahead of the first: the later of two.
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

  const std::string flips = "flip=20%";
  std::vector<std::uint64_t> bits(8 * kSize);
  double flipped = 0;
  play(parse_profile(flips), {.size = kSize}, options, [&](std::size_t, const Decision& decision) {
    if (!decision.flipped_bit) return;
    ++flipped;
    ++bits.at(*decision.flipped_bit);
  });
  checks.push_back(rate(flips, "flip rate", flipped, n, 0.2));
  checks.push_back(pearson(flips, "which bit", bits, even_shares(bits.size())));

  const std::string cuts = "truncate=20%";
  std::vector<std::uint64_t> left(kSize);
  double cut = 0;
  play(parse_profile(cuts), {.size = kSize}, options, [&](std::size_t, const Decision& decision) {
    if (!decision.truncated_to) return;
    ++cut;
    ++left.at(*decision.truncated_to);
  });
  checks.push_back(rate(cuts, "truncation rate", cut, n, 0.2));
  checks.push_back(pearson(cuts, "bytes left", left, even_shares(left.size())));

  const std::string rebind = "rebind(every=10s)";
  std::size_t off = 0;
  play(parse_profile(rebind), {}, options,
       [&](std::size_t i, const Decision& decision) { off += decision.rebinds == i / 10'000 ? 0U : 1U; });
  checks.push_back(none(rebind, "source ports that differ", off));
  return checks;
}

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
  checks.push_back(none(jitter, "releases before the one ahead", backwards));
  checks.push_back(none(jitter, "releases that are not max(the one ahead, own)", off));

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

/// A queue of `places` datagrams of equal cost, played by itself: when each leaves, none for one that found it full.
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

std::vector<Check> bottleneck(const SelftestOptions& options) {
  std::vector<Check> checks;
  const auto n = static_cast<double>(options.count);
  // 972 bytes and 28 of headers: 0.8 ms at 10 Mbit/s. No two events at the same time.
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
    checks.push_back(none(line, "decisions that differ from a queue's", off));
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

  // Three opportunities in 10 ms carry 4500 bytes: of datagrams of 1000 bytes, sent at twice that, two leave with the
  // second half of one … the k-th when 1000 (k + 1) bytes have been carried.
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

/// Which of the windows first, first + every, … lasting `lasts` the time t is in; none when in none.
bool in_window(Duration t, Duration first, Duration every, Duration lasts) {
  return t >= first && (t - first) % every < lasts;
}

std::vector<Check> events(const SelftestOptions& options) {
  std::vector<Check> checks;
  // At times that no datagram meets to the nanosecond.
  const Traffic traffic{.period = Duration(1'000'003)};
  /// Deviations of the delay from a function of the arrival, in ns at the most.
  const auto worst = [&](const std::string& line, const std::function<double(double)>& expected_ms) {
    double most = 0;
    play(parse_profile(line), traffic, options, [&](std::size_t, const Decision& decision) {
      const double expected = expected_ms(ns(decision.arrival - kStart) / kMs) * kMs;
      most = std::max(most, std::abs(ns(delay(decision)) - expected));
    });
    checks.push_back({line, "furthest from its delay, ns", most, 1});
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

/// A measured histogram, and where it was read from.
struct Histogram {
  std::filesystem::path file;
  Cdf law;
};

std::vector<Histogram> histograms_in(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) throw std::runtime_error(folder.string() + " is no folder");
  std::vector<Histogram> found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".csv") continue;
    if (auto law = histogram_law(entry.path())) found.push_back({entry.path(), std::move(*law)});
  }
  if (found.empty()) throw std::runtime_error("no histogram in " + folder.string());
  std::ranges::sort(found, {}, &Histogram::file);
  return found;
}

Check measured(const Histogram& histogram, const SelftestOptions& options) {
  const Profile profile = parse_profile("order=free delay=histogram(" + histogram.file.string() + ")");
  return kolmogorov("delay=histogram(" + histogram.file.filename().string() + ")", "Kolmogorov",
                    delays(profile, {}, options), histogram.law);
}

// ---- Output ---------------------------------------------------------------------------------------------------------

std::string json_line(const Check& check) {
  return JsonLine()
             .add("model", check.model)
             .add("statistic", check.statistic)
             .add("value", check.value)
             .add("bound", check.bound)
             .add("passed", check.passed())
             .str() +
         "\n";
}

std::string text_line(const Check& check, bool same_model) {
  std::ostringstream out;
  if (!same_model) out << check.model << "\n";
  out << "  " << std::left << std::setw(50) << check.statistic << std::right << std::setprecision(4) << std::setw(12)
      << check.value << " <= " << std::left << std::setw(12) << check.bound << (check.passed() ? "PASS" : "FAIL")
      << "\n";
  return out.str();
}

}  // namespace

std::vector<Check> check_delays(std::string_view line, const Cdf& law, double rho, bool continuous,
                                const SelftestOptions& options) {
  const std::string model(line);
  const auto samples = delays(parse_profile(line), {}, options);
  std::vector<Check> checks = {kolmogorov(model, "Kolmogorov", samples, law, independent_samples(samples.size(), rho))};
  if (!continuous) return checks;
  const auto n = static_cast<double>(samples.size());
  if (rho == 0) {
    // No distance sees far out; counting does. A hundred expected, so that their law is normal enough.
    const double far = std::max(1e-4, 100 / n);
    const auto high = std::ranges::count_if(samples, [&](double x) { return law(x) > 1 - far; });
    const auto low = std::ranges::count_if(samples, [&](double x) { return law(x) < far; });
    checks.push_back(rate(model, "share of the longest", static_cast<double>(high), n, far));
    checks.push_back(rate(model, "share of the shortest", static_cast<double>(low), n, far));
  }
  const auto z = normal_scores(samples, law);
  // Its standard deviation and its bias are those of AR(1): Bartlett 1946, Kendall 1954.
  checks.push_back({model, "autocorrelation of z against rho", std::abs(autocorrelation(z, 1) - rho),
                    most_deviations() * std::sqrt((1 - rho * rho) / n) + (1 + 3 * rho) / n});
  if (rho > 0) append(checks, check_innovations(model, innovations(z, [rho](std::size_t) { return rho; })));
  return checks;
}

std::vector<Check> check_losses(std::string_view line, const LossChain& chain, const SelftestOptions& options) {
  std::vector<bool> events;
  events.reserve(options.count);
  play(parse_profile(line), {}, options,
       [&](std::size_t, const Decision& decision) { events.push_back(lost(decision)); });
  return check_events(std::string(line), "loss", events, chain);
}

std::optional<Cdf> histogram_law(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<double> edges;
  std::vector<double> below = {0};
  for (std::string line; std::getline(file, line);) {
    line = line.substr(0, line.find('#'));
    std::ranges::replace_if(
        line, [](char c) { return c == ',' || c == ';' || c == '\t' || c == '\r'; }, ' ');
    if (line.find_first_not_of(' ') == std::string::npos) continue;
    std::istringstream fields(line);
    double edge = 0;
    double weight = 0;
    std::string more;
    if (!(fields >> edge >> weight) || fields >> more) return std::nullopt;
    if (weight < 0 || (!edges.empty() && edge * kMs <= edges.back())) return std::nullopt;
    edges.push_back(edge * kMs);
    below.push_back(below.back() + weight);
  }
  if (edges.size() < 2 || below.back() <= 0) return std::nullopt;
  edges.push_back(2 * edges.back() - edges[edges.size() - 2]);
  for (auto& share : below) share /= below.back();
  return [edges, below](double x) {
    const auto above = std::ranges::upper_bound(edges, x);
    if (above == edges.begin()) return 0.0;
    if (above == edges.end()) return 1.0;
    const auto i = static_cast<std::size_t>(above - edges.begin() - 1);
    return below[i] + (below[i + 1] - below[i]) * (x - edges[i]) / (edges[i + 1] - edges[i]);
  };
}

bool selftest(const SelftestOptions& options, std::ostream& out) {
  if (options.count < kFewest) {
    throw std::invalid_argument("--count is " + std::to_string(options.count) + ", expected at least " +
                                std::to_string(kFewest));
  }
  const auto measured_histograms = options.data ? histograms_in(*options.data) : std::vector<Histogram>{};
  std::size_t failed = 0;
  std::size_t made = 0;
  std::string model;
  const auto write = [&](const std::vector<Check>& checks) {
    for (const Check& check : checks) {
      out << (options.json ? json_line(check) : text_line(check, check.model == model)) << std::flush;
      model = check.model;
      ++made;
      failed += check.passed() ? 0U : 1U;
    }
  };
  for (const auto group : {all_delays, memory, first_datagrams, independence, all_losses, separation, regimes, order,
                           copies_and_damage, bottleneck, events}) {
    write(group(options));
  }
  for (const Histogram& histogram : measured_histograms) write({measured(histogram, options)});
  if (options.json) {
    out << R"({"checks":)" << made << R"(,"failed":)" << failed << R"(,"count":)" << options.count << R"(,"seed":)"
        << options.seed << "}\n";
  } else {
    out << made << " checks of " << options.count << " datagrams each, seed " << options.seed << ": "
        << (failed == 0 ? "all passed" : std::to_string(failed) + " FAILED") << "\n";
  }
  return failed == 0;
}

}  // namespace tendon::injector
