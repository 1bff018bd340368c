// SPDX-License-Identifier: Apache-2.0
// A Falcon's driver, packets, kinematics and encoder counts, on a model with known friction.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "core/identification/friction_identification.h"
#include "devices/falcon/falcon_device.h"
#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/model_pipe.h"
#include "tests/tools/lab/identify/simulated_ramps.h"

namespace tendon::lab::falcon_ramps_test {
namespace {

using namespace std::chrono_literals;

constexpr double kMass = 0.1;  // kg

/// A Falcon whose grip is a mass on a rail along x, with its own motors and known friction.
class FalconOnARail final : public Device {
 public:
  FalconOnARail(const Friction& friction, double begin)
      : friction_(friction), x_(begin), falcon_({.has_firmware = true, .is_homed = true}) {
    falcon_.move_to(falcon::kCentre + Vec3(x_, 0, 0));
    while (state() != State::kHomed) {
      if (now_ > LocalTime(1s)) throw std::runtime_error("the Falcon is not ready");
      read(now_ + 1ms);
      apply(Vec3::Zero());
    }
  }

  const DeviceInfo& info() const noexcept override { return device_.info(); }
  State state() const noexcept override { return device_.state(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    move_until(now);
    return device_.read(now);
  }
  Vec3 apply(const Vec3& force) noexcept override { return device_.apply(force); }

  LocalTime now() const { return now_; }

 private:
  static constexpr Duration kStep = 50us;

  void move_until(LocalTime then) noexcept {
    const double force = falcon_.force().x();
    const double dt = seconds(kStep);
    for (; now_ < then; now_ += kStep) {
      const double pushed = speed_ + dt / kMass * (force - friction_.viscous * speed_);
      const double lost = dt / kMass * friction_.coulomb;
      speed_ = std::copysign(std::max(std::abs(pushed) - lost, 0.0), pushed);
      x_ += speed_ * dt;
    }
    falcon_.move_to(falcon::kCentre + Vec3(x_, 0, 0));
  }

  Friction friction_;
  double x_;          // m
  double speed_ = 0;  // m/s
  LocalTime now_{};
  FakeFalcon falcon_;
  FalconDevice device_{{}, std::make_unique<ModelPipe<FakeFalcon>>(falcon_, now_)};
};

/// Uses slow ramps: a reply is one period old, which adds rate · period to the apparent Coulomb friction.
Identification identified(const Friction& friction) {
  std::vector<RampRun> runs;
  for (const double rate : {0.1, 0.25, -0.1, -0.25}) {
    for (const double begin : {0.030, 0.034}) {
      FalconOnARail device(friction, rate > 0 ? -begin : begin);
      runs.push_back(run_ramp(device, device.now() + 1ms, {.rate = rate, .travel = 0.06}));
    }
  }
  return identify_friction(runs, {.mass = kMass, .encoder_step = 43e-6});
}

TEST(FalconIdentification, FindsTheModelsFrictionWithinTheBoundsItStates) {
  const Friction truth{.coulomb = 0.2, .viscous = 1};
  const Identification found = identified(truth);
  const PlaceEstimate& place = found.places.at(0);
  EXPECT_LE(std::abs(place.integral.coulomb - truth.coulomb), 3 * place.integral_error.coulomb);
  EXPECT_LE(std::abs(place.integral.viscous - truth.viscous), 3 * place.integral_error.viscous);
  EXPECT_LE(found.lower_bound.coulomb, truth.coulomb);
  EXPECT_LE(found.lower_bound.viscous, truth.viscous);
  EXPECT_GE(found.lower_bound.coulomb, 0.95 * truth.coulomb);
  EXPECT_GE(found.lower_bound.viscous, 0.9 * truth.viscous);
  std::cout << "f_c " << place.integral.coulomb << " ± " << place.integral_error.coulomb << " N, b "
            << place.integral.viscous << " ± " << place.integral_error.viscous << " N·s/m\n";
}

}  // namespace
}  // namespace tendon::lab::falcon_ramps_test
