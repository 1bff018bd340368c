// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/cpp/engine/fd_stiffness.h"
#include "clients/cpp/force_client.h"

namespace tendon {

struct SelfTest {
  enum class Verdict {
    kPassed = 1,
    kFailed = 2,
    kNotJudged = 3,  ///< not supported by the engine, or the test is inconclusive
  };
  struct Finding {
    Verdict verdict = Verdict::kNotJudged;
    std::string what;  ///< the tested claim: "gives out no more than it was given: press and release"
    std::string why;   ///< the result with its numbers
    double value = 0;  ///< measured value in the unit given in `why`; 0 if none
    double bound = 0;  ///< allowed value in the same unit; 0 if none

    std::string text() const;
    std::string json() const;
  };
  std::vector<Finding> findings;

  bool passed() const;       ///< whether no finding failed and the hand felt a force
  std::string text() const;  ///< one line for each finding: "failed   the claim: its numbers"
  /// A {"finding":{"verdict":"failed","what":…,"why":…,"value":…,"bound":…}} per line; null if a number is not finite.
  std::string json() const;
};

/// Motion of the scripted hand. It begins at `start`, which must be outside of all bodies (where the engine stores no
/// energy), and moves by `depth` in direction `into`.
struct SelfTestScript {
  Vec3 start = Vec3(-0.005, 0, 0);  ///< m
  Vec3 into = Vec3::UnitX();        ///< need not be normalized
  double depth = 0.015;             ///< m, > 0, from `start`
  double slide = 0.01;              ///< m, > 0, tangential displacement at that depth, in both directions
  double speed = 0.1;               ///< m/s, > 0, maximum; each path is repeated at a quarter of it
  double rate_hz = 1000;            ///< > 0, states per second
  double work_tolerance = 0.01;     ///< ≥ 0, relative to the work done by the hand
  bool elastic = false;          ///< the engine dissipates no energy, so closed paths must return all work to the hand
  double stiffness_step = 1e-5;  ///< m, > 0, step of fd_stiffness
  double stiffness_tolerance = 0.05;  ///< ≥ 0, relative to ‖K‖; half of the error that the server's model could detect
  SavedState state{};                 ///< for engines with a state in time; without it, their stiffness is not judged
};

/// Tests the callback of an engine with scripted motion, without a server, device or network:
///
/// * **Passivity.** On closed paths (press and release, and loops with a slide in three planes; in both directions,
///   slowly and fast), the work done on the hand, Σ ½(F(k) + F(k+1))·(x(k+1) − x(k)), never exceeds `work_tolerance`
///   times the work done by the hand, plus the difference between the sums with all samples and with every second
///   sample. That difference is three times the error of the trapezoidal rule. Forces that lag, increase with speed, or
///   have a curl fail. The server's limiter would contain such an engine, but the body would feel soft.
/// * **Elasticity**, if the script sets `elastic`: the energy lost at the end of each path is within the same bound. A
///   shape that snaps from one equilibrium to another loses more, as does a solver that stops too early.
/// * **Stiffness** equals −∂F/∂x by fd_stiffness at rest at four depths, unless a surface is within one step.
/// * **Robustness** to a hand at NaN, infinity, 1 km away, or a denormal position; a repeated tick; a pause of one
///   second; a jump. The engine must not throw, its answers to finite states must be finite (at most
///   limits::kMaxValue), and its answer at `start` must be unchanged afterwards.
///
/// Unless stated otherwise, each state follows the previous one by one tick and 1/rate_hz s. The test covers half a
/// minute of simulated time and ends at `start`. Throws std::invalid_argument "FIELD = VALUE: expected …" if `script`
/// is invalid. Exceptions of `engine` are reported as findings. `tell` is called with each finding.
SelfTest self_test(const Physics& engine, const SelfTestScript& script = {},
                   const std::function<void(const SelfTest::Finding&)>& tell = {});

}  // namespace tendon
