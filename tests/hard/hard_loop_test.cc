// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "devices/simulated/simulated_device.h"
#include "tests/hard/loop_case.h"
#include "tests/hard/row.h"

namespace tendon::hard::hard_loop_test {
namespace {

Observed rate_collapse(std::uint64_t seed, bool limiter) {
  Case set(seed);
  set.engine.rate_hz = 1000;
  if (!limiter) set.let_all_through();
  Bench bench(set);
  bench.run(seconds(1));
  // Receives a state every 200 ms. The delay of the answer is also 200 ms.
  bench.world.network().change(Case::weather("base=199ms", "outage(at=0ms,every=200ms,for=199ms)"), bench.world.now());
  bench.run(milliseconds(2200));  // the hand comes to rest
  bench.world.network().change(Case::fair(), bench.world.now());
  bench.disturbance_is_over();
  bench.run(seconds(3));
  return bench.seen();
}

// Oracle: passive, bounded, quiet. During these two seconds, the hand is moving, and the forces are 200 to 400 ms old.
TEST(HardLoop, AnEngineThatFallsFrom1000To5HzInContactStaysPassive) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return rate_collapse(seed, true); });
  report({.hard = "a force of 0.4 s ago pushes a hand that has turned back",
          .oracle = "the bounds; quiet after 1 s",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("AOL off", kWithin, [](std::uint64_t seed) { return rate_collapse(seed, false); })});
}

Observed bad_network(std::uint64_t seed, bool limiter, bool decay) {
  Case set(seed);
  set.engine.valid_for = milliseconds(500);
  if (!limiter) set.let_all_through();
  if (!decay) set.control().hold.hold = set.control().hold.safe_stop = seconds(100);
  Bench bench(set);
  bench.run(seconds(1));
  bench.world.network().change(
      Case::weather("delay=uniform(0ms,300ms) order=free loss=20% duplicate=30% replay(5%,64)",
                    "outage(at=0ms,every=200ms,for=195ms) delay=uniform(0ms,50ms) order=free duplicate=30%"),
      bench.world.now());
  bench.run(seconds(2));
  bench.world.network().change(Case::weather("loss=100%", "loss=100%"), bench.world.now());
  // Datagrams in flight arrive at most 350 ms later.
  bench.expect_of_steps(no_force_from(bench.world.now() + milliseconds(350) + kSilence));
  bench.run(milliseconds(1800));
  bench.expect_of_steps({});
  bench.world.network().change(Case::fair(), bench.world.now());
  bench.disturbance_is_over();
  bench.run(seconds(5));
  return bench.seen();
}

// Oracle: passive, bounded, quiet. There must be no force from 760 ms after the last arrival until the engine is back.
TEST(HardLoop, FiveHertzOutOfOrderThenSilenceIsPassiveAndFadesToZero) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return bad_network(seed, true, true); });
  report({.hard = "old forces arrive after new ones and twice, then no more arrive",
          .oracle = "the bounds; zero 0.76 s after the last arrival; quiet after 1 s",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("AOL off", kWithin, [](std::uint64_t seed) { return bad_network(seed, false, true); }) +
                     "; " +
                     without("decay off", kWithin, [](std::uint64_t seed) { return bad_network(seed, true, false); })});
}

Observed restart(std::uint64_t seed, bool ramp) {
  Case set(seed);
  if (!ramp) set.control().hold.ramp_in = Duration::zero();
  const Duration gone = set.dice.milliseconds(300, 900);
  Bench bench(set);
  bench.run(milliseconds(2750));
  bench.world.kill(bench.engine);
  bench.run(gone);
  const LocalTime back = bench.world.now();
  set.engine.seed = 2;
  bench.world.restart_controller(bench.engine, set.engine, set.physics);
  // At most the deepest force of the wall over the ramp of 100 ms, plus a quarter for the motion of the hand.
  const double fastest = 1.25 * set.stiffness * 0.02 / 0.1;
  std::optional<LocalTime> engaged;
  bench.expect_of_steps([=](const StepRecord& step) mutable -> std::string {
    if (!engaged && step.mode == Mode::kActive && step.hand.at > back) engaged = step.hand.at;
    if (!engaged || step.hand.at - *engaged > milliseconds(30)) return {};
    const double rate = (step.applied.norm() - step.was_applied.norm()) / 1e-3;
    return rate <= fastest ? "" : text_of(rate, "N/s as it comes back");
  });
  bench.disturbance_is_over();
  bench.run(seconds(3));
  return bench.seen();
}

// Oracle: passive, bounded, quiet. The force must return over 100 ms although the hand has moved deeper into the wall.
TEST(HardLoop, AnEngineKilledInContactAndRestartedDoesNotKick) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return restart(seed, true); });
  report({.hard = "the hand has moved deeper meanwhile, so the first force is the largest",
          .oracle = "E ≥ 0; ≤ 8 N; returns with at most 1.25 of the wall's force per 100 ms; quiet after 1 s",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("ramp off", kWithin, [](std::uint64_t seed) { return restart(seed, false); })});
}

Observed teleport(std::uint64_t seed, bool limits, bool limiter) {
  Case set(seed);
  // MuJoCo's tool pulled with 153 N at a distance of 20 mm from the hand.
  const Vec3 pull = 153 * set.dice.direction();
  set.physics = [wall = set.physics, pull](const DeviceState& hand) -> Touch {
    if (hand.tick >= 2800 && hand.tick < 3100) return pull;
    return wall(hand);
  };
  if (!limits) {
    set.control().max_force = 1000;
    set.control().max_slew = kInf;
  }
  if (!limiter) set.let_all_through();
  Bench bench(set);
  bench.run(milliseconds(3100));
  bench.disturbance_is_over();
  bench.run(seconds(3));
  return bench.seen();
}

// Oracle: passive, bounded, quiet, while the engine requests 153 N from one step to the next for 0.3 s.
TEST(HardLoop, AToolThatTeleports20MillimetresDoesNotThrowTheHand) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return teleport(seed, true, true); });
  report({.hard = "20 mm of a virtual coupling are 153 N at once (measured with MuJoCo)",
          .oracle = "the bounds; quiet after 1 s",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("force and slew limit off", kWithin,
                             [](std::uint64_t seed) { return teleport(seed, false, true); }) +
                     "; " +
                     without("and AOL off", kWithin, [](std::uint64_t seed) { return teleport(seed, false, false); })});
}

Observed edge(std::uint64_t seed, bool limiter) {
  Case set(seed);
  const Vec3 u = set.into;
  const Vec3 w = set.across;
  set.physics = [u, w](const DeviceState& hand) -> Touch {
    const double from_u = hand.position.dot(u);
    const double from_w = hand.position.dot(w);
    if (from_u <= 0 || from_w <= 0) return Vec3(0, 0, 0);
    return from_u < from_w ? Vec3(-3000 * from_u * u) : Vec3(-3000 * from_w * w);
  };
  ScriptedMotion::MinimumJerk reach;
  reach.back_and_forth = false;
  reach.points = {Vec3(-0.01 * (u + w)), Vec3(0.012 * (u + w))};
  reach.durations = {milliseconds(800)};
  for (int i = 0; i < 10; ++i) {  // around the edge
    reach.points.emplace_back(0.012 * (u + w) + set.dice.within(-0.002, 0.002) * (u - w));
    reach.durations.emplace_back(milliseconds(200));
  }
  reach.points.emplace_back(0.008 * u + 0.04 * w);
  reach.durations.emplace_back(milliseconds(500));
  set.device.hand->motion = ScriptedMotion(std::move(reach));
  set.world.weather = Case::weather("delay=uniform(5ms,15ms)", "delay=uniform(5ms,15ms)");
  if (!limiter) set.let_all_through();
  Bench bench(set);
  bench.run(milliseconds(3300));
  bench.disturbance_is_over();
  bench.run(seconds(3));
  return bench.seen();
}

// Oracle: passive, bounded, and quiet once the hand is on one face. On the edge the normal rotates by 90° between two
// answers, 20 ms late.
TEST(HardLoop, ContactThatChattersOnAnEdgeStaysPassive) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return edge(seed, true); });
  report({.hard = "on an edge, the normal turns by 90° between two late answers",
          .oracle = "the bounds; quiet 1 s after it is left",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("AOL off", kWithin, [](std::uint64_t seed) { return edge(seed, false); })});
}

Observed pull_through(std::uint64_t seed, bool limiter) {
  Case set(seed);
  // A plate of 8 mm, which pushes toward the nearer side. It holds a hand that has touched it up to 5 mm.
  set.physics = [n = set.into, k = set.stiffness, stuck = false](const DeviceState& hand) mutable -> Touch {
    const double depth = hand.position.dot(n);
    const double out = depth < 0.004 ? depth : depth - 0.008;  // distance to the nearer side; > 0 is inside near the
    stuck = stuck ? std::abs(out) < 0.005 : depth > 0 && depth < 0.008;
    return stuck ? Vec3(-k * out * n) : Vec3(0, 0, 0);
  };
  ScriptedMotion::MinimumJerk reach;
  reach.back_and_forth = false;
  for (int i = 0; i < 4; ++i) {
    reach.points.insert(reach.points.end(), {Vec3(-0.02 * set.into), Vec3(0.03 * set.into)});
  }
  reach.points.emplace_back(-0.02 * set.into);
  for (std::size_t i = 1; i < reach.points.size(); ++i) reach.durations.push_back(set.dice.milliseconds(300, 450));
  set.device.hand->motion = ScriptedMotion(std::move(reach));
  set.world.weather = Case::weather("delay=uniform(5ms,15ms)", "delay=uniform(5ms,15ms)");
  if (!limiter) set.let_all_through();
  Bench bench(set);
  bench.run(milliseconds(3600));
  bench.disturbance_is_over();
  bench.run(seconds(2));
  return bench.seen();
}

// Oracle: passive, bounded, quiet. In the middle of the plate the force reverses, and adhesion pulls back.
TEST(HardLoop, PullingThroughAThinPlateThatSticksStaysPassive) {
  constexpr Duration kWithin = seconds(1);
  const Observed seen = kept(kWithin, [](std::uint64_t seed) { return pull_through(seed, true); });
  report({.hard = "beyond the middle of a thin plate, the force reverses; adhesion pulls",
          .oracle = "the bounds; quiet 1 s after it is out",
          .result = result_of(seen),
          .margin = margin_of(seen, kWithin),
          .without = without("AOL off", kWithin, [](std::uint64_t seed) { return pull_through(seed, false); })});
}

}  // namespace
}  // namespace tendon::hard::hard_loop_test
