// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/wave_law.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/expect.h"

namespace tendon {

namespace {

WavePort<3> wave_port_of(const CouplingConfig& config, double impedance) {
  expect_above_zero(impedance, "own_damping");
  // The speed is at most max_force/B if the force is max_force.
  const double max_wave = 2 * config.spring.max_force / std::sqrt(2 * impedance);
  return WavePort<3>({.impedance = impedance,
                      .period = config.spring.period,
                      .smoothing = std::max(config.spring.period, WavePort<3>::kSmoothing),
                      .max_wave = max_wave,
                      .encoder_step = config.encoder_step});
}

}  // namespace

WaveLaw::WaveLaw(const CouplingConfig& config, const MappedEnd& frame)
    : damping_(config.spring.own_damping),
      max_force_(config.spring.max_force),
      port_(wave_port_of(config, frame.stiffness(damping_))) {}

void WaveLaw::receive(const PortState& peer, const PortState& /*before*/, bool anew, const MappedEnd& frame) noexcept {
  const PoseMap& map = frame.map();
  const WaveMessage<3> wave{
      .sequence = peer.sequence,
      .time = peer.time,
      .integral = frame.leads() ? map.wave_to_leader(peer.wave_integral) : map.wave_to_follower(peer.wave_integral),
      .energy = peer.wave_energy * frame.joule()};
  if (anew || !joined_) {
    port_.join(wave);
    joined_ = true;
  } else {
    port_.receive(wave);
  }
}

std::optional<EnergyTank::Settlement> WaveLaw::observe(const LawInterval& ended) noexcept {
  Interval<3> end{.applied = force_, .dx = -takes_back_, .held = ended.interval.held};
  takes_back_.setZero();
  last_dx_.setZero();
  if (moves_) {
    last_dx_ = ended.interval.dx;
    end.dx += last_dx_;
    // The limiter and the motors make the end of the line softer. The ramp does not.
    end.applied = ended.interval.applied + force_ - ended.wanted;
  }
  sent_ = port_.observe(end, {.payable = ended.payable, .reserve = ended.reserve, .wanted = line_});
  return EnergyTank::Settlement{.credit = port_.taken(), .withdraw = port_.given()};
}

Demand<3> WaveLaw::command(const LawPeriod& period, const Vec3& speed, const Demand<3>& /*spring*/) noexcept {
  if (moves_ && period.clutched) takes_back_ += last_dx_;
  moves_ = period.live;
  if (!moves_ && !period.clutched) port_.rest();
  Demand<3> demand = port_.command(moves_ ? speed : Vec3(Vec3::Zero()));
  line_ = moves_ || period.clutched ? demand.force : Vec3(Vec3::Zero());
  demand.force = at_most(demand.force, max_force_);
  force_ = at_most(line_, max_force_);
  return demand;
}

void WaveLaw::skip(const LawPeriod& period, Duration elapsed) noexcept {
  last_dx_.setZero();
  // The motion is not known in this interval and in the next one, so the account does not pay for the line.
  port_.observe({.applied = force_, .dx = Vec3::Zero(), .held = elapsed},
                {.payable = -std::numeric_limits<double>::max(), .wanted = line_});
  command(period, Vec3::Zero(), {});
}

double WaveLaw::stiffness(const LawPeriod& period, double /*share*/, Duration round_trip) const noexcept {
  const double impedance = damping_ * period.frame.stiffness(1);
  return impedance / (seconds(round_trip) / 2 + seconds(port_.playout() + kLineWaits));
}

}  // namespace tendon
