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

struct Packet {
  LocalTime arrival{};
  std::uint32_t size = 0;              ///< bytes of UDP payload
  std::span<const std::byte> bytes{};  ///< the payload, for drop rules; no rule matches if empty
};

enum class Verdict : std::uint8_t { kPass, kDrop, kDuplicate };

/// The model that dropped the datagram, or else the last step that determined the release time.
enum class Cause : std::uint8_t {
  kDelay,  ///< its own delay
  kQueue,  ///< waited at the bottleneck
  kStall,  ///< the datagram waited for the end of a stall
  kFifo,
  kReorder,
  kQueueFull,
  kOutage,
  kHandover,
  kRule,
  kRegime,  ///< the loss model of the regime
  kLoss,
  kReplay,
};

std::string_view to_string(Verdict verdict) noexcept;
std::string_view to_string(Cause cause) noexcept;
std::optional<Verdict> parse_verdict(std::string_view text) noexcept;
std::optional<Cause> parse_cause(std::string_view text) noexcept;

/// The fate of one datagram, which is final on its arrival.
struct Decision {
  std::uint64_t index = 0;  ///< number of the datagram within its link and direction, from 0
  LocalTime arrival{};
  std::uint32_t size = 0;
  Verdict verdict = Verdict::kPass;
  Cause cause = Cause::kDelay;
  LocalTime release{};                 ///< release of the first copy; for a dropped datagram, when it would have left
  std::optional<LocalTime> duplicate;  ///< release of the second copy, not before `release`
  /// Sends the payload of the datagram `back` places earlier (1, 2, …) once more, independently of this datagram.
  struct Stale {
    LocalTime release{};
    std::uint32_t back = 0;
    bool operator==(const Stale&) const = default;
  };
  std::optional<Stale> stale;
  std::optional<std::uint32_t> flipped_bit;   ///< bit n % 8 of byte n / 8 of the payload before truncation
  std::optional<std::uint32_t> truncated_to;  ///< bytes
  std::uint32_t rebinds = 0;                  ///< number of changes of the source port so far
  bool operator==(const Decision&) const = default;
};

class Decider {
 public:
  virtual ~Decider() = default;
  virtual Decision decide(const Packet& packet) = 0;
};

/// A reproducible network impairment in one direction. The same seed and the same arrivals give the same decisions on
/// every machine and compiler, because it uses integers and counter-based random numbers, without floating point or
/// libm.
///
///     bottleneck  t₁ = end of transmission from the queue, or kQueueFull and no further steps
///     delay       t₂ = t₁ + max(0, base + F⁻¹(u) + regime + step, ramp, spike, handover)
///     stall       t₃ = t₂, or the end of the stall that contains t₂
///     order       releaseₙ = max(releaseₙ₋₁, t₃) for fifo, t₃ for free, an earlier time for a jump
///     loss        outage, handover, drop rules, the loss of the regime or else of the profile
///     copies      duplicate, stale replay; damage: flip, truncate
///
/// The fields of a profile are independent. Each draws its own numbers for each datagram (see Draws). A lost datagram
/// is lost at the end of the route, so its successors wait for it as for any other, and none waits for a second copy or
/// a datagram that jumped. Adding loss, duplicates or damage to a profile therefore changes no other decision.
///
/// Thread-safe: no.
class Injector final : public Decider {
 public:
  /// Throws std::invalid_argument as check(profile) does. `start`: origin of the profile's times; the first arrival if
  /// not set. Building the tables takes up to a few milliseconds; copying an injector does not.
  Injector(const Profile& profile, std::uint64_t seed, std::uint32_t link, Direction direction,
           std::optional<LocalTime> start = std::nullopt);

  /// Returns an injector for another link that shares the tables of this one. Call it only before the first decision.
  Injector for_link(std::uint32_t link) const;
  Injector for_link(std::uint32_t link, LocalTime start) const;

  /// Arrivals should not decrease; if they do, FIFO order still holds. A datagram that exceeds a route of 60 s plus its
  /// queue is not delayed further.
  Decision decide(const Packet& packet) override;

  /// The times of the new profile are relative to `now`. Keeps the index, draws, queue, order and the states of
  /// correlated delay and loss. Throws like the constructor, without any effect in that case.
  void change(const Profile& profile, LocalTime now);
  /// Uses the profile and tables of another injector. Builds no tables and does not throw.
  void change(const Injector& prepared, LocalTime now);

  const Profile& profile() const { return network_.profile; }

  std::uint64_t table_hash() const noexcept;

 private:
  struct Network {
    explicit Network(const Profile& profile);
    Profile profile;
    QuantileTable delay;
    std::vector<QuantileTable> regime_delays;
    Copula copula;
    Copula regime_copula;
    LossModel loss;
    std::vector<std::optional<LossModel>> regime_losses;
    std::vector<QuantileTable> outage_lengths;
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
  std::vector<OutageChain> outages_;  ///< those of random length
  std::uint64_t next_visit_ = 0;      ///< next number of a visit to a regime, counted across profiles
  std::uint64_t next_index_ = 0;
  std::uint32_t rebinds_before_ = 0;  ///< by earlier profiles
  LocalTime last_release_ = LocalTime::min();
  std::array<LocalTime, kMaxJump> releases_{};  ///< ring buffer by index
};

}  // namespace tendon::injector
