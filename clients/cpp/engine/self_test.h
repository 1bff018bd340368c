// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/cpp/engine/fd_stiffness.h"
#include "clients/cpp/force_client.h"

namespace tendon {

/// Findings of a scripted hand about an engine.
struct SelfTest {
  enum class Verdict {
    kPassed = 1,
    kFailed = 2,
    kNotJudged = 3,  ///< the engine does not do that, or the test cannot tell
  };
  struct Finding {
    Verdict verdict = Verdict::kNotJudged;
    std::string what;  ///< the claim: "gives out no more than it was given: press and release"
    std::string why;   ///< with its numbers
    double value = 0;  ///< measured, in the unit that `why` names; 0 where there is none
    double bound = 0;  ///< allowed, in the same unit; 0 where there is none

    std::string text() const;  ///< its line of SelfTest::text()
    std::string json() const;  ///< its line of SelfTest::json()
  };
  std::vector<Finding> findings;

  /// Nothing failed, and something was felt.
  bool passed() const;
  /// A line for each finding: "failed   the claim: its numbers".
  std::string text() const;
  /// A line for each finding: {"finding":{"verdict":"failed","what":…,"why":…,"value":…,"bound":…}}, where a number
  /// that is not finite is null.
  std::string json() const;
};

/// How the hand moves in a self-test: from `start`, which is outside all bodies (where the engine holds no energy), by
/// `depth` in the direction `into`.
struct SelfTestScript {
  Vec3 start = Vec3(-0.005, 0, 0);  ///< m
  Vec3 into = Vec3::UnitX();        ///< its length is not used
  double depth = 0.015;             ///< m, > 0, from `start`
  double slide = 0.01;              ///< m, > 0, aside at that depth, both ways
  double speed = 0.1;               ///< m/s, > 0, the fastest; each way is gone at a quarter of it too
  double rate_hz = 1000;            ///< > 0, states per second
  double work_tolerance = 0.01;     ///< of the work that the hand has put in, ≥ 0
  /// Nothing that the engine simulates takes energy: what a closed way has cost, the hand gets back.
  bool elastic = false;
  double stiffness_step = 1e-5;       ///< m, > 0: fd_stiffness's
  double stiffness_tolerance = 0.05;  ///< of ‖K‖, ≥ 0: half of what the server's model could tell
  /// For an engine that goes on in time: without it its stiffness is not judged.
  SavedState state{};
};

/// Presses an engine's callback by a script, without a server, a device or a network, and says which of its answers a
/// hand would feel as wrong:
///
/// * **It gives out no more than it was given.** On closed ways (press and release, and around loops with a slide in
///   three planes; each in either direction, slowly and fast) the work Σ ½(F(k) + F(k+1))·(x(k+1) − x(k)) that it has
///   done on the hand never exceeds `work_tolerance` of the work that the way costs the hand, plus the difference that
///   using every second state alone would make, which is three times the error of the trapezoids. A force that lags,
///   grows with the speed, or has a curl does not pass. The limiter would contain it, and the body would feel soft.
/// * **It gives back what it took**, when the script says that it is `elastic`: what is missing at the end of each of
///   these ways has the same bound. A shape that snaps from one place of rest to another loses more, and so does a
///   solver that stops too early.
/// * **Its stiffness is −∂F/∂x**, by fd_stiffness at rest at four depths, where no surface is within a step.
/// * **Odd states do it no harm.** A hand at NaN, at infinity, 1 km away, at a denormal; the same tick twice; a pause
///   of a second; a jump. The engine throws nothing, its answers to finite states are finite (at most
///   limits::kMaxValue), and back at `start` it answers as before.
///
/// Every state is a tick and 1/rate_hz s after the previous one, except where a claim says otherwise. The hand ends at
/// `start`. Half a minute of the hand's time passes; the engine's own pace decides how long that takes. Throws
/// std::invalid_argument "FIELD = VALUE: expected …" when a value of `script` is impossible; nothing that `engine`
/// throws. `tell` is given each finding as soon as it is one, for an engine whose answers take long.
SelfTest self_test(const Physics& engine, const SelfTestScript& script = {},
                   const std::function<void(const SelfTest::Finding&)>& tell = {});

}  // namespace tendon
