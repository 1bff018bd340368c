// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/remote/channel_rule.h"
#include "core/remote/held_force.h"

namespace tendon {

/// Combines the forces of several engines into one wanted force. Each engine has a channel with its own HeldForce (the
/// force it holds, its age, what its estimator has learned):
///
///     F  =  Σ Fᵢ  over the channels of rule kSum  +  Σ wⱼ Fⱼ  over those of rule kPriority
///
/// Among the channels of rule kPriority, the first in order whose force is fresh (the freshest, when none is) takes all
/// the weight: its w goes to 1 at the rate of 1 per `ramp_in`, and the others keep their proportions, so that Σ w = 1
/// and one engine fades over into the next. Stiffnesses, torques and grip forces are combined in the same way.
///
/// ForceChannels decides which force is *wanted*. The limiter after it sees only the sum, and keeps engines that fight
/// each other in check as it does a single wrong one.
///
/// Thread-safe: no. Realtime-safe: yes, but for the constructor.
class ForceChannels {
 public:
  struct Config {
    HeldForce::Config hold;                                ///< of every channel
    std::vector<ChannelRule> rules = {ChannelRule::kSum};  ///< of the channels, in order; at least one
  };

  struct Wanted : HeldForce::Wanted {
    /// The channel of the freshest force, the first of equally fresh ones: `mode` and `age` are its.
    std::size_t channel = 0;
  };

  /// Throws std::invalid_argument when there is no channel, and what HeldForce throws.
  explicit ForceChannels(const Config& config);

  std::size_t size() const noexcept { return channels_.size(); }

  /// A newer force of one channel; false when it was refused because it is not sound.
  bool observe(std::size_t channel, const RemoteForce& force) noexcept {
    return channels_[channel].held.observe(force);
  }
  /// The remote environment of one channel has left.
  void release(std::size_t channel, std::uint32_t source, LocalTime now) noexcept {
    channels_[channel].held.release(source, now);
  }
  /// Forgets all forces.
  void disengage() noexcept;

  /// The force wanted at `hand.position` at `hand.at`, and the torque at `orientation`. Call it once in each haptic
  /// step.
  Wanted wanted(const Motion& hand, const Quat* orientation = nullptr) noexcept;

  /// The force that a channel holds; empty when idle.
  const std::optional<RemoteForce>& newest(std::size_t channel) const noexcept {
    return channels_[channel].held.newest();
  }

 private:
  struct Channel {
    HeldForce held;
    ChannelRule rule;
    double weight;  ///< 1 for ever in a sum
    HeldForce::Wanted wants{};
  };

  void shift_weights(LocalTime now) noexcept;

  Duration ramp_;
  std::vector<Channel> channels_;
  LocalTime last_{};  ///< the step before
};

}  // namespace tendon
