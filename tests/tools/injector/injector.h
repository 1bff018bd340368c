// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/models/bottleneck.h"
#include "tests/tools/injector/models/delay_model.h"
#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/models/loss_model.h"
#include "tests/tools/injector/models/quantile_table.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/profile/timeline.h"

namespace tendon::injector {

/// A datagram that enters the network.
struct Packet {
  LocalTime arrival{};
  std::uint32_t size = 0;              ///< bytes of UDP payload
  std::span<const std::byte> bytes{};  ///< the payload, for drop rules; may be empty: then no rule matches
};

enum class Verdict : std::uint8_t { kPass, kDrop, kDuplicate };

/// Why a datagram met its fate: for a dropped one what dropped it, for one that passed what decided its release last.
enum class Cause : std::uint8_t {
  // passed
  kDelay,    ///< its own delay
  kQueue,    ///< besides, it waited at the bottleneck
  kStall,    ///< … and for the end of a stall
  kFifo,     ///< … and for the one ahead
  kReorder,  ///< it left ahead of its place
  // dropped
  kQueueFull,
  kOutage,
  kHandover,
  kRule,
  kRegime,  ///< the loss of the regime
  kLoss,
  // either
  kReplay,  ///< a trace says so
};

/// "pass", "drop", "dup".
std::string_view to_string(Verdict verdict) noexcept;
/// "delay", "queue", "stall", "fifo", "reorder", "queue-full", "outage", "handover", "rule", "regime", "loss",
/// "replay".
std::string_view to_string(Cause cause) noexcept;
std::optional<Verdict> parse_verdict(std::string_view text) noexcept;
std::optional<Cause> parse_cause(std::string_view text) noexcept;

/// The fate of one datagram, final when it is decided: at its arrival.
struct Decision {
  std::uint64_t index = 0;  ///< counts the datagrams of this direction of this link from 0
  LocalTime arrival{};
  std::uint32_t size = 0;
  Verdict verdict = Verdict::kPass;
  Cause cause = Cause::kDelay;
  LocalTime release{};                 ///< of the first copy; a dropped one has one too: when it would have left
  std::optional<LocalTime> duplicate;  ///< release of the second copy, never before the first
  /// Besides, whatever happens to this one, the payload of the datagram `back` before it (1, 2, …) leaves once more.
  struct Stale {
    LocalTime release{};
    std::uint32_t back = 0;
    bool operator==(const Stale&) const = default;
  };
  std::optional<Stale> stale;
  std::optional<std::uint32_t> flipped_bit;   ///< of the payload: bit n % 8 of byte n/8; before it is cut
  std::optional<std::uint32_t> truncated_to;  ///< bytes
  std::uint32_t rebinds = 0;                  ///< how often the source port has changed so far
  bool operator==(const Decision&) const = default;
};

/// Decides the fate of each datagram of one direction of one link. Two kinds: Injector (a profile and a seed) and
/// TracePlayer (recorded decisions).
class Decider {
 public:
  virtual ~Decider() = default;
  virtual Decision decide(const Packet& packet) = 0;
};

/// A replayable bad network in one direction: the same seed and the same arrivals give the same decisions, on every
/// machine and compiler (integers over counter-based random numbers; no floating point, no libm).
///
///     bottleneck  t₁ = when the queue has sent it                          — or kQueueFull, and nothing else happens
///     delay       t₂ = t₁ + max(0, base + F⁻¹(u) + regime + step, ramp, spike, handover)
///     stall       t₃ = t₂, or the end of the stall that t₂ falls into
///     order       releaseₙ = max(releaseₙ₋₁, t₃)                           — fifo; free: t₃; a jump: earlier
///     loss        outage, handover, drop rules, the loss of the regime or else of the profile
///     copies      duplicate, stale replay; damage: flip, truncate
///
/// Fields of a profile do not disturb each other. Each draws its own numbers for each datagram (see Draws), a datagram
/// that is lost is lost at the end of the route (those behind it wait as if it had come through), and nobody waits for
/// a second copy or for one that jumped: so adding loss, duplicates or damage to a profile leaves all other decisions
/// as they were.
///
/// Thread-safe: no.
class Injector final : public Decider {
 public:
  /// Throws std::invalid_argument as check(profile) does. The times of the profile count from `start`; when it is not
  /// given, from the first arrival. Building the tables takes up to some milliseconds; copying an injector does not.
  Injector(const Profile& profile, std::uint64_t seed, std::uint32_t link, Direction direction,
           std::optional<LocalTime> start = std::nullopt);

  /// The injector of another link, as if built for it, with the tables of this one. Only before the first decision.
  Injector for_link(std::uint32_t link) const;
  /// … and the times of the profile count from `start`.
  Injector for_link(std::uint32_t link, LocalTime start) const;

  /// Arrivals should not go back in time; when they do, FIFO still holds. A datagram that does not fit into a
  /// route of 60 s and its queue is not delayed further.
  Decision decide(const Packet& packet) override;

  /// Another profile from now on, whose times count from `now`. Index, draws, queue, order and the states of correlated
  /// delay and loss go on. Throws like the constructor, and then nothing has changed.
  void change(const Profile& profile, LocalTime now);
  /// The same with the profile and the tables of another injector: no table is built, and nothing is thrown.
  void change(const Injector& prepared, LocalTime now);

  const Profile& profile() const { return network_.profile; }

  /// Over all quantile tables in use: what a trace records to say what it was made with.
  std::uint64_t table_hash() const noexcept;

 private:
  /// A profile made ready for deciding.
  struct Network {
    explicit Network(const Profile& profile);
    Profile profile;
    QuantileTable delay;
    std::vector<QuantileTable> regime_delays;
    Copula copula;
    Copula regime_copula;
    LossModel loss;
    std::vector<std::optional<LossModel>> regime_losses;
    std::vector<Chance> rules;
    Chance duplicate;
    Chance replay;
    Chance flip;
    Chance truncate;
    Chance jump;
    bool has_events;  ///< steps, ramps, spikes, handovers
  };

  void adopt(Network next, LocalTime now);
  void begin(LocalTime start);
  std::optional<Cause> cause_of_loss(const Packet& packet, std::uint64_t index, std::optional<std::size_t> regime);
  LocalTime past_stalls(LocalTime at) const;

  Draws draws_;
  std::uint64_t seed_;
  Direction direction_;
  Network network_;
  std::optional<LocalTime> given_start_;
  bool begun_ = false;
  LocalTime start_{};
  std::optional<BottleneckQueue> bottleneck_;
  std::optional<RegimeChain> regimes_;
  std::uint64_t next_visit_ = 0;  ///< of a regime, after those of profiles before this one
  std::uint64_t next_index_ = 0;
  std::uint32_t rebinds_before_ = 0;  ///< of profiles before this one
  LocalTime last_release_ = LocalTime::min();
  std::array<LocalTime, kMaxJump> releases_{};  ///< in their places, of the last ones, by index
};

}  // namespace tendon::injector
