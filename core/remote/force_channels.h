// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/remote/channel_rule.h"
#include "core/remote/field_use.h"
#include "core/remote/held_force.h"

namespace tendon {

/// Combines the forces of several engines into one demand. There is a channel with a HeldForce for each engine.
///     F  =  Σ Fᵢ  over the channels of rule kSum  +  Σ wⱼ Fⱼ  over those of rule kPriority
/// The first kPriority channel with a fresh force gets all the weight; if no force is fresh, it is the channel with the
/// freshest force. Its w increases to 1 at a rate of 1 per `ramp_in`, while the others keep their proportions, so that
/// Σ w = 1 and the engines are cross-faded. Stiffnesses, torques and grip forces are combined in the same way. The
/// limiter bounds the result, even if the engines oppose each other (core/PROOFS.md, "Several channels").
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class ForceChannels {
 public:
  struct Config {
    HeldForce::Config hold;                                ///< of every channel
    std::vector<ChannelRule> rules = {ChannelRule::kSum};  ///< for each channel; not empty
  };

  struct Wanted : HeldForce::Wanted {
    std::size_t channel = 0;  ///< with the freshest force, to which `mode` and `age` belong
  };

  /// Throws std::invalid_argument if there is no channel, and what HeldForce throws.
  explicit ForceChannels(const Config& config);

  std::size_t size() const noexcept { return channels_.size(); }

  /// Returns false if the force is refused because it is not sound.
  bool observe(std::size_t channel, const RemoteForce& force) noexcept {
    return channels_[channel].held.observe(force);
  }
  bool observe(std::size_t channel, const field::TimedPose& pose) noexcept {
    return channels_[channel].held.observe(pose);
  }
  bool use(std::size_t channel, const FieldUse& use, LocalTime now) noexcept {
    return channels_[channel].held.use(use, now);
  }
  /// Must be called when the remote environment of a channel has disconnected.
  void release(std::size_t channel, std::uint32_t source, LocalTime now) noexcept {
    channels_[channel].held.release(source, now);
  }
  void disengage() noexcept;

  /// Must be called once per haptic step.
  Wanted wanted(const Motion& hand, const Quat* orientation = nullptr) noexcept;

  bool has_fields() const noexcept { return has_fields_; }  ///< the part `field` is listed

  /// Renders the fields of all channels and adds their weighted forces to `wanted`. Must be called after `wanted`.
  /// `account` is E in J. Each field can use E + Σ credit − Σ wⱼ Hⱼ, where Hⱼ is the stored energy of the other
  /// fields and the credit is that of the fields before. Returns nothing if no field is in use.
  std::optional<FieldStep> render(const Motion& hand, double account, std::uint64_t tick, Wanted& wanted) noexcept;

  /// Generation of the field in use, or 0.
  std::uint32_t field(std::size_t channel) const noexcept { return channels_[channel].held.field(); }

  /// Returns the force of a channel, or nothing if there is no force.
  const std::optional<RemoteForce>& newest(std::size_t channel) const noexcept {
    return channels_[channel].held.newest();
  }

 private:
  struct Channel {
    HeldForce held;
    ChannelRule rule;
    double weight;  ///< always 1 in a sum and if there is no other channel
    HeldForce::Wanted wants{};
  };

  void shift_weights(LocalTime now) noexcept;

  Duration ramp_;
  bool has_fields_;
  std::vector<Channel> channels_;
  LocalTime last_{};  ///< previous step
};

}  // namespace tendon
