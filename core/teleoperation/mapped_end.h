// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "core/teleoperation/port_state.h"
#include "core/teleoperation/port_values.h"
#include "core/teleoperation/pose_map.h"

namespace tendon {

/// Maps values from the peer to this end of a coupling. The leader can change the scales while the program runs. Its
/// states contain the new scales, and the follower uses those of the newest state. If a joule of the follower is worth
/// more after the change, the follower only keeps a part of its account, so the pair does not generate energy.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class MappedEnd {
 public:
  static constexpr double kLeast = 0.01;
  static constexpr double kMost = 100;

  /// Throws the same exceptions as PoseMap.
  MappedEnd(const PoseMap::Config& scene, PortRole role) : scene_(scene), map_(scene), role_(role) {}

  bool leads() const noexcept { return role_ == PortRole::kLeader; }
  const PoseMap& map() const noexcept { return map_; }

  /// `displacement` is a position (m) or a velocity (m/s) of the peer.
  Vec3 mapped(const Vec3& displacement) const noexcept {
    return leads() ? map_.to_leader(displacement) : map_.to_follower(displacement);
  }
  Vec3 coupled(const Vec3& vector) const noexcept {
    return leads() ? map_.coupled_at_leader(vector) : map_.coupled_at_follower(vector);
  }
  /// Returns the value of one joule of the peer in joules of this end.
  double joule() const noexcept { return leads() ? map_.leader_joule() : map_.follower_joule(); }
  /// Converts an energy in J from the leader to this end.
  double worth(double at_leader) const noexcept { return at_leader * (leads() ? 1 : map_.follower_joule()); }
  /// Converts a stiffness or a damping from the leader to this end.
  double stiffness(double at_leader) const noexcept {
    return leads() ? at_leader : map_.stiffness_at_follower(at_leader);
  }

  /// `told` is true if these are not the scales of the scene.
  void rescale(double position_scale, double force_scale, bool told) noexcept {
    const double joule = map_.leader_joule();
    map_ = map_.scaled(position_scale, force_scale);
    if (!leads() && map_.leader_joule() > joule) kept_ *= joule / map_.leader_joule();
    told_ = told;
  }
  /// Sets the scales of a follower to those of the scene. Returns false if this is not necessary.
  bool rescale_as_scene() noexcept {
    if (leads() || !told_) return false;
    rescale(scene_.position_scale, scene_.force_scale, false);
    return true;
  }
  /// Sets the scales of a follower to those in the state of the leader.
  void rescale_as_told(const PortState& leader) noexcept {
    const bool told = leader.position_scale > 0 && leader.force_scale > 0;
    rescale(told ? leader.position_scale : scene_.position_scale, told ? leader.force_scale : scene_.force_scale, told);
  }
  /// Returns true if the state uses the same scales. If a scale in a state is 0, the scale of the scene is used.
  bool tells_ours(const PortState& peer) const noexcept {
    const auto same = [](double told, double scene, double used) { return (told > 0 ? told : scene) == used; };
    return same(peer.position_scale, scene_.position_scale, map_.position_scale()) &&
           same(peer.force_scale, scene_.force_scale, map_.force_scale());
  }
  bool told() const noexcept { return told_; }

  /// Returns the part of the account to keep and resets it to 1.
  double take_kept() noexcept { return std::exchange(kept_, 1); }

 private:
  PoseMap::Config scene_;
  PoseMap map_;
  PortRole role_;
  bool told_ = false;
  double kept_ = 1;
};

}  // namespace tendon
