// SPDX-License-Identifier: Apache-2.0
#include "core/remote/force_channels.h"

#include <algorithm>
#include <stdexcept>

namespace tendon {
namespace {

/// Rank of freshness; 0 is the freshest.
int staleness(Mode mode) noexcept {
  switch (mode) {
    case Mode::kActive:
      return 0;
    case Mode::kHolding:
      return 1;
    case Mode::kDecaying:
      return 2;
    case Mode::kSafeStop:
    case Mode::kFault:
      return 3;
    case Mode::kIdle:
      return 4;
  }
  return 4;
}

}  // namespace

ForceChannels::ForceChannels(const Config& config)
    : ramp_(config.hold.ramp_in), has_fields_(config.hold.field.has_value()) {
  if (config.rules.empty()) throw std::invalid_argument("a device needs at least one channel");
  for (const ChannelRule rule : config.rules) {
    const bool whole = rule == ChannelRule::kSum || config.rules.size() == 1;
    channels_.push_back({.held = HeldForce(config.hold), .rule = rule, .weight = whole ? 1.0 : 0.0});
  }
}

void ForceChannels::disengage() noexcept {
  for (Channel& channel : channels_) channel.held.disengage();
}

void ForceChannels::shift_weights(LocalTime now) noexcept {
  const auto ranked = [](const Channel& channel) { return channel.rule == ChannelRule::kPriority; };
  const auto first = std::find_if(channels_.begin(), channels_.end(), ranked);
  if (first == channels_.end()) return;
  auto winner = first;
  for (auto channel = first + 1; channel != channels_.end(); ++channel) {
    if (ranked(*channel) && staleness(channel->wants.mode) < staleness(winner->wants.mode)) winner = channel;
  }
  double others = 0;
  for (const Channel& channel : channels_) {
    if (ranked(channel)) others += channel.weight;
  }
  others -= winner->weight;
  // If there is no other channel, the forces are not cross-faded.
  const double step = others <= 0 ? 1.0 : ramp_ > Duration::zero() ? seconds(now - last_) / seconds(ramp_) : 1.0;
  const double mine = std::min(1.0, winner->weight + std::max(0.0, step));
  const double share = others > 0 ? (1 - mine) / others : 0.0;
  for (Channel& channel : channels_) {
    if (ranked(channel)) channel.weight *= share;
  }
  winner->weight = mine;
}

ForceChannels::Wanted ForceChannels::wanted(const Motion& hand, const Quat* orientation) noexcept {
  if (channels_.size() == 1) return {channels_.front().held.wanted(hand, orientation), 0};
  for (Channel& channel : channels_) channel.wants = channel.held.wanted(hand, orientation);
  shift_weights(hand.at);
  last_ = hand.at;

  const auto lead = std::min_element(channels_.begin(), channels_.end(), [](const Channel& a, const Channel& b) {
    return staleness(a.wants.mode) < staleness(b.wants.mode);
  });
  Wanted sum{lead->wants, static_cast<std::size_t>(lead - channels_.begin())};
  sum.force.setZero();
  sum.stiffness.setZero();
  sum.handle.reset();
  for (const Channel& channel : channels_) {
    if (channel.weight == 0) continue;
    sum.force += channel.weight * channel.wants.force;
    sum.stiffness += channel.weight * channel.wants.stiffness;
    if (const auto& asked = channel.wants.handle) {
      if (!sum.handle) sum.handle.emplace();
      sum.handle->torque += channel.weight * asked->torque;
      sum.handle->grip += channel.weight * asked->grip;
    }
    // The device is not in a safe stop if another channel is active.
    if (channel.wants.mode != Mode::kSafeStop) sum.reasons |= channel.wants.reasons;
  }
  return sum;
}

std::optional<FieldStep> ForceChannels::render(const Motion& hand, double account, std::uint64_t tick,
                                               Wanted& wanted) noexcept {
  std::optional<FieldStep> result;
  double stored = 0;  // Σ w H₀ of the fields that are not rendered yet, Σ w H of the others
  for (const Channel& channel : channels_) stored += channel.weight * channel.held.stored(hand.position);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    if (channel.held.field() == 0) continue;
    stored -= channel.weight * channel.held.stored(hand.position);
    const field::Renderer::Rendered rendered = channel.held.render(hand, account - stored, tick);
    stored += channel.weight * rendered.stored;
    account += rendered.credit;
    wanted.stiffness += channel.weight * rendered.stiffness;
    if (!result) result.emplace();
    if (result->generation == 0 || (result->depth == 0 && rendered.depth > 0)) {
      result->generation = channel.held.field();
      result->channel = static_cast<std::uint8_t>(i);
      result->swapping = rendered.swapping;
      result->depth = rendered.depth;
      result->proxy = rendered.proxy;
    }
    result->force += channel.weight * rendered.force;
    result->refused += rendered.refused;
    result->credit += rendered.credit;
  }
  if (!result) return result;
  result->stored = stored;
  wanted.force += result->force;
  return result;
}

}  // namespace tendon
