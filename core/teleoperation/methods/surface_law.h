// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/coupling_law.h"

namespace tendon {

/// The method `surface`: the follower uses the law of ContactLaw, and estimates the surface at its tool from the
/// contact force (SurfaceEstimator). The leader renders this surface at its own rate (SurfaceRenderer) and adds the
/// force −B v. The account pays for each change of the surface. Each act starts without a surface.
class SurfaceLaw : public CouplingLaw {
 public:
  SurfaceLaw(const CouplingConfig& config, const MappedEnd& frame);

  void receive(const PortState& peer, const PortState& before, bool anew, const MappedEnd& frame) noexcept;
  void forget() noexcept;
  void begin_act(const Vec3& u) noexcept;
  Demand<3> command(const LawPeriod& period, const Vec3& speed, const Demand<3>& spring) noexcept;
  void conclude(const LawPeriod& period, const Vec3& applied, const std::optional<Vec3>& contact) noexcept;
  LawPart part() const noexcept { return {.surface = found_}; }
  double stiffness(const LawPeriod& period, double share, Duration round_trip) const noexcept;

 private:
  SurfaceEstimator<3>::Config config_;
  double damping_;                                ///< B, N·s/m
  std::optional<SurfaceEstimator<3>> estimator_;  ///< only at the follower
  std::optional<SurfaceRenderer<3>> renderer_;    ///< only at the leader
  std::optional<PortSurface> found_;              ///< in this act, only at the follower
};

}  // namespace tendon
