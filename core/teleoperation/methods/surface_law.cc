// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/surface_law.h"

#include <algorithm>
#include <cmath>

namespace tendon {

namespace {

/// Converts a surface of the follower to the frame and the scale of the leader. m is the coupled part of Rᵀ n_f:
///     F_l = s_f s_x K_f (d/s_x − m·u_l)₊ m
SurfaceModel<3> at_leader(const PortSurface& from, const PoseMap& map, std::uint64_t sequence) {
  const double stiffer = 1 / map.stiffness_at_follower(1);  // s_f s_x
  const double scale = std::sqrt(stiffer / map.leader_joule());
  const Vec3 m = scale * map.to_leader(from.normal);
  const double length = m.norm();
  if (!(length > 1e-3)) return {.sequence = sequence};  // The normal is orthogonal to the coupled axes.
  return {.sequence = sequence,
          .normal = m / length,
          .offset = from.offset / (scale * length),
          .stiffness = stiffer * from.stiffness * length * length};
}

}  // namespace

SurfaceLaw::SurfaceLaw(const CouplingConfig& config, const MappedEnd& frame)
    : config_(config.surface), damping_(config.spring.own_damping) {
  if (frame.leads()) {
    renderer_.emplace();
  } else {
    estimator_.emplace(config.surface);
  }
}

void SurfaceLaw::receive(const PortState& /*peer*/, const PortState& /*before*/, bool anew,
                         const MappedEnd& /*frame*/) noexcept {
  if (anew) forget();
}

void SurfaceLaw::forget() noexcept {
  if (renderer_) renderer_.emplace();
}

void SurfaceLaw::begin_act(const Vec3& /*u*/) noexcept {
  if (renderer_) renderer_.emplace();
  if (estimator_) estimator_.emplace(config_);
  found_.reset();
}

Demand<3> SurfaceLaw::command(const LawPeriod& period, const Vec3& speed, const Demand<3>& spring) noexcept {
  if (!renderer_) return spring;
  Demand<3> demand{Vec3::Zero()};
  if (period.live) {
    const PortState& peer = period.peer;
    if (peer.surface && period.serves) {
      renderer_->receive(at_leader(*peer.surface, period.frame.map(), peer.sequence));
    }
    demand = renderer_->command(period.u, std::max(period.payable - renderer_->energy(period.u), 0.0)).demand;
  }
  demand.force -= damping_ * speed;
  return demand;
}

void SurfaceLaw::conclude(const LawPeriod& period, const Vec3& /*applied*/,
                          const std::optional<Vec3>& contact) noexcept {
  if (!estimator_ || !period.live || !contact) return;
  const SurfaceModel<3> found = estimator_->observe(period.u, *contact);
  found_ = {.normal = found.normal, .offset = found.offset, .stiffness = found.stiffness};
}

double SurfaceLaw::stiffness(const LawPeriod& period, double share, Duration /*round_trip*/) const noexcept {
  if (!renderer_) return share * period.stiffness;
  return period.peer.surface ? at_leader(*period.peer.surface, period.frame.map(), 1).stiffness : 0;
}

}  // namespace tendon
