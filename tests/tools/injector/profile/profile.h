// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/time.h"

namespace tendon::injector {

/// A value, or the lower edge of a bin. Weights are relative to their sum.
struct Weighted {
  Duration value{};
  double weight = 0;
  bool operator==(const Weighted&) const = default;
};

// Clamped to 0 … kMaxDelay.

struct ConstantDelay {  ///< delay=20ms
  Duration value{};
  bool operator==(const ConstantDelay&) const = default;
};
struct UniformDelay {  ///< delay=uniform(LOW,HIGH), both inclusive
  Duration low{}, high{};
  bool operator==(const UniformDelay&) const = default;
};
struct NormalDelay {  ///< delay=normal(MEAN,SD)
  Duration mean{}, deviation{};
  bool operator==(const NormalDelay&) const = default;
};
struct ExponentialDelay {  ///< delay=exponential(LEAST,MEAN): LEAST + an exponential of mean MEAN − LEAST
  Duration least{}, mean{};
  bool operator==(const ExponentialDelay&) const = default;
};
struct LognormalDelay {  ///< delay=lognormal(MEAN,SD): mean and standard deviation of the delay, not of its logarithm
  Duration mean{}, deviation{};
  bool operator==(const LognormalDelay&) const = default;
};
struct ParetoDelay {  ///< delay=pareto(LEAST,SHAPE): P(delay > x) = (LEAST/x)^SHAPE; no mean for SHAPE ≤ 1
  Duration least{};
  double shape = 0;
  bool operator==(const ParetoDelay&) const = default;
};
struct GammaDelay {  ///< delay=gamma(MEAN,SD): shape (MEAN/SD)²
  Duration mean{}, deviation{};
  bool operator==(const GammaDelay&) const = default;
};
/// delay=mixture(LEAST,WEIGHT:MEAN,…): P(delay > LEAST + x) = Σ wᵢ exp(−x/MEANᵢ), wᵢ = WEIGHTᵢ / Σ WEIGHT. Each
/// MEAN is counted from LEAST.
struct MixtureDelay {
  Duration least{};
  std::vector<Weighted> parts;  ///< the means, in any order
  bool operator==(const MixtureDelay&) const = default;
};
/// delay=histogram(LOWER:WEIGHT,…) or histogram(FILE.csv). Uniform within a bin. The last bin is as wide as its
/// predecessor; a histogram with one bin is a constant delay.
struct HistogramDelay {
  std::vector<Weighted> bins;  ///< increasing
  bool operator==(const HistogramDelay&) const = default;
};
/// delay=samples(VALUE:WEIGHT,…), samples(FILE.csv) or netem(FILE.dist,MEAN,SD): exactly these values.
struct SampledDelay {
  std::vector<Weighted> values;  ///< increasing
  bool operator==(const SampledDelay&) const = default;
};
using Delay = std::variant<ConstantDelay, UniformDelay, NormalDelay, ExponentialDelay, LognormalDelay, ParetoDelay,
                           GammaDelay, HistogramDelay, SampledDelay, MixtureDelay>;

struct RandomLoss {  ///< loss=2%: independent losses
  double probability = 0;
  bool operator==(const RandomLoss&) const = default;
};
/// loss=burst(2%,4): a Gilbert chain of this loss rate and mean burst length L, with P(G→B) = p/(1 − p)/L and P(B→G) =
/// 1/L (as WebRTC's SimulatedNetwork).
struct BurstLoss {
  double probability = 0;
  double length = 1;
  bool operator==(const BurstLoss&) const = default;
};
/// loss=gilbert(P,R,BAD,GOOD): the Gilbert-Elliott chain. P = P(G→B), R = P(B→G) per datagram; the loss probability is
/// BAD (netem's 1−h) in B and GOOD (netem's 1−k) in G. As in the kernel, the state before the transition decides.
/// Unlike there, the chain starts in its stationary distribution, so that short runs are not better than long ones.
struct GilbertLoss {
  double to_bad = 0, to_good = 1, lost_in_bad = 1, lost_in_good = 0;
  bool operator==(const GilbertLoss&) const = default;
};
/// loss=fourstate(P13,P31,P32,P23,P14), in netem's order. States: 1 received in a gap, 2 received in a burst, 3 lost in
/// a burst, 4 lost alone (then always 1). Each datagram makes a transition and is lost if that ends in 3 or 4. Starts
/// in the stationary distribution.
struct FourStateLoss {
  double p13 = 0, p31 = 0, p32 = 0, p23 = 0, p14 = 0;
  bool operator==(const FourStateLoss&) const = default;
};
struct PatternLoss {  ///< loss=pattern(0001): 1 is lost; starts with the first datagram and repeats
  std::string pattern;
  bool operator==(const PatternLoss&) const = default;
};
/// loss=bursts(pareto2,P12,P21,SHAPE1:SCALE1,SHAPE2:SCALE2): bursts of random length, each followed by one datagram
/// that passes (NetFI's GE_Pareto_BLL). The length is drawn in the state i in which the burst begins, and can be 0:
///
///     P(length ≥ k) = (1 + k/SCALEᵢ)^(−SHAPEᵢ)        Pareto II, rounded down to whole datagrams
///
/// Each datagram, lost or not, first makes a transition with P12 or P21. Starts with a new burst, and with the
/// stationary distribution of the states.
struct ParetoBurstLoss {
  struct Length {
    double shape = 2, scale = 0;
    bool operator==(const Length&) const = default;
  };
  double p12 = 0, p21 = 1;
  std::array<Length, 2> lengths;
  bool operator==(const ParetoBurstLoss&) const = default;
};
using Loss = std::variant<RandomLoss, BurstLoss, GilbertLoss, FourStateLoss, PatternLoss, ParetoBurstLoss>;

/// drop(byte=16,mask=0xf,value=3,50%): datagrams with (payload[byte] & mask) == value are lost with this probability.
struct DropRule {
  std::uint32_t byte = 0;
  std::uint8_t mask = 0xff;
  std::uint8_t value = 0;
  double probability = 1;
  bool operator==(const DropRule&) const = default;
};

// Times count from the activation of the profile, for the first profile from the injector's start.

/// regime(NAME,dwell=4s,delay=…,loss=…): a state of a continuous-time Markov chain that is independent of the traffic.
/// The dwell time is exponential with this mean; all other states are equally likely successors. The chain starts with
/// the first regime. The regime's delay is added, and its loss, if given, replaces the profile's.
struct Regime {
  std::string name;
  Duration dwell{};
  Delay delay;
  std::optional<Loss> loss;
  bool operator==(const Regime&) const = default;
};

/// at=5s,for=300ms once · every=15s,for=300ms at 15 s, 30 s, … · at=5s,every=15s,for=300ms at 5 s, 20 s, …
struct Window {
  Duration at{};
  Duration every{};  ///< zero: once
  Duration lasts{};  ///< shorter than `every`
  bool operator==(const Window&) const = default;
};

struct Step {  ///< step(at=5s,20ms): added from then on; may be negative
  Duration at{}, change{};
  bool operator==(const Step&) const = default;
};
struct Ramp {  ///< ramp(from=5s,to=10s,30ms): grows linearly to this value, which may be negative, and stays there
  Duration from{}, to{}, change{};
  bool operator==(const Ramp&) const = default;
};
struct Spike {  ///< spike(every=15s,for=50ms,80ms): added to datagrams that arrive in the window
  Window when;
  Duration extra{};
  bool operator==(const Spike&) const = default;
};
struct Stall {  ///< stall(every=2s,for=100ms): datagrams leave at the end of the window instead of within it
  Window when;
  bool operator==(const Stall&) const = default;
};
/// handover(every=15s,for=60ms,10ms): arrivals in the window are lost. After the window, the delay changes by a random
/// value between −10 ms and 10 ms until the next handover.
struct Handover {
  Window when;
  Duration change{};
  bool operator==(const Handover&) const = default;
};
struct Outage {  ///< outage(at=5s,for=300ms): arrivals in the window are lost
  Window when;
  bool operator==(const Outage&) const = default;
};
/// outage(clear=8.5s,for=uniform(0ms,3s)): a time without losses, then an outage of random length, and so on. The
/// length follows a law of Delay.
struct RandomOutage {
  Duration clear{};
  Delay length;
  bool operator==(const RandomOutage&) const = default;
};

struct Replay {  ///< replay(1%,64): sends one of the last 64 datagrams again with this probability
  double probability = 0;
  std::uint32_t depth = 0;
  bool operator==(const Replay&) const = default;
};
/// jump(1%,3): with this probability a datagram leaves just ahead of the one 3 before it, or of as many as it can still
/// overtake if its own delay is only `base`. jump(1%,1) swaps neighbors. Other datagrams do not move.
struct Jump {
  double probability = 0;
  std::uint32_t places = 0;
  bool operator==(const Jump&) const = default;
};
enum class Order : std::uint8_t {
  kFifo,  ///< order=fifo: releases are monotone despite jitter, because a route does not reorder
  kFree,  ///< order=free: each leaves after its own delay, as in netem
};

/// rate=10Mbit/s or opportunities(FILE), queue=64kB or queue=50packets, overhead=28. A datagram costs its payload plus
/// the overhead. A full queue, which includes the datagram in transmission, drops it (tail drop). There is no head
/// drop, because it would depend on later arrivals, whereas a decision is final.
struct Bottleneck {
  std::uint64_t bits_per_second = 0;  ///< zero: none
  /// Mahimahi's packet-delivery opportunities (mm-link): up to 1500 bytes leave at each of these times, in ms.
  /// Increasing, repeated with the period of the last one. Unused bytes are lost. Excludes a rate.
  std::vector<std::uint32_t> opportunities_ms;
  std::uint64_t queue = 1000;  ///< netem's default, in packets
  bool queue_in_bytes = false;
  std::uint32_t overhead = 28;  ///< bytes per datagram: the IPv4 and UDP headers
  bool exists() const { return bits_per_second > 0 || !opportunities_ms.empty(); }
  bool operator==(const Bottleneck&) const = default;
};

/// The behavior of a bad network in one direction. As text, one line with fields in any order, each at most once except
/// drop, regime, step, ramp, spike, stall, handover and outage:
///
///     base=5ms delay=lognormal(20ms,5ms) rho=0.9 loss=burst(2%,4) spike(every=15s,for=50ms,80ms) rate=10Mbit/s
///     queue=64kB
///
/// Durations are numbers with a unit (ns, us, ms, s), rounded to nanoseconds; probabilities are 2% or 0.02.
struct Profile {
  Duration base{};  ///< base=5ms: constant delay
  Delay delay;
  /// Correlation of consecutive delays: a Gaussian copula AR(1) (see Copula), which keeps their distribution exact. By
  /// packet (rho=0.9), or by time (memory=20ms): ρ = exp(−Δt/memory).
  double rho = 0;
  Duration memory{};  ///< zero: none
  Loss loss;
  std::vector<DropRule> rules;
  std::vector<Regime> regimes;
  std::vector<Step> steps;
  std::vector<Ramp> ramps;
  std::vector<Spike> spikes;
  std::vector<Stall> stalls;
  std::vector<Handover> handovers;
  std::vector<Outage> outages;
  std::vector<RandomOutage> random_outages;
  double duplicate = 0;  ///< duplicate=1%: a second copy with its own delay, never ahead of the first
  Replay replay;
  double flip = 0;      ///< flip=0.1%: flips one bit of the payload
  double truncate = 0;  ///< truncate=0.1%: truncates the payload to 0 … size − 1 bytes
  Duration rebind{};    ///< rebind(every=10s): changes the source port, as a NAT does; zero: never
  Order order = Order::kFifo;
  Jump jump;
  Bottleneck bottleneck;

  bool operator==(const Profile&) const = default;
};

/// Longer delays are irrelevant for haptics, and this bounds the memory of a proxy.
inline constexpr Duration kMaxDelay = std::chrono::seconds(60);

/// Limit for events of one kind, drop rules and regimes, which are all evaluated for each datagram.
inline constexpr std::size_t kMaxEvents = 64;

/// Limits the time to build the table of a mixture.
inline constexpr std::size_t kMaxParts = 16;

/// Measured histograms have about 100 bins; the tables of netem 4096 values; a minute of 1 kHz 60 000 samples.
inline constexpr std::size_t kMaxValues = 65'536;

/// The longest traces of Mahimahi are 15 minutes of LTE: 700 000 opportunities.
inline constexpr std::size_t kMaxOpportunities = 1'000'000;

inline constexpr std::uint32_t kMaxReplayDepth = 64;
inline constexpr std::uint32_t kMaxJump = 64;

/// Throws std::invalid_argument if `profile` is invalid, for example "loss is 150%, expected a probability from 0% to
/// 100%".
void check(const Profile& profile);

/// One line without default values; tables are inline (histogram(0.56ms:72,…)). parse_profile(to_string(p)) == p
/// exactly for every p that passes check().
std::string to_string(const Profile& profile);

/// Reads the files that the line names. Throws std::invalid_argument that names field, value and expected format. The
/// result has passed check().
Profile parse_profile(std::string_view line);

/// Fields replace those of `onto`, events are added.
Profile parse_profile(std::string_view line, Profile onto);

}  // namespace tendon::injector
