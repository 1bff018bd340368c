// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "tests/tools/worlds/drawn_world.h"
#include "tests/tools/worlds/watched_device.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation {

/// What must hold in every world.
enum class Oracle : std::uint8_t {
  kLedger,
  kTruth,
  kBound,
  kFinite,
  kFresh,
  kStopped,
  kNewest,
  kDrained,
  kCounters,
  kRoundTrip,
  kClock,
  kRecovery,
  kCalm,
  kPress,
};

struct OracleInfo {
  Oracle oracle;
  std::string_view name;
  std::string_view sentence;
};
std::span<const OracleInfo> oracles() noexcept;
const OracleInfo& info(Oracle oracle) noexcept;

/// A promise that a world has broken, and when.
struct Breach {
  Oracle oracle{};
  LocalTime at{};
  std::string what;
};

/// After the weather has cleared, the last datagram of the bad weather has arrived and the last client has died, everybody
/// who lives is served again within
///
///     2 s          a session that only one end believes in ends by the timeout of the other (Session::Config::timeout)
///   + retry_max    the wait that a client may then be in (ForceClient::Config)
///   + 600 ms       two Hellos and their answers, repeated every 100 ms, and the first state and force
Duration recovery_promise(const DrawnWorld& world);

/// Watches a world from outside, step by step and turn by turn, and says which promise was broken first. It believes
/// nothing that the code under test says of itself when it can see it: it keeps its own account of the port
/// (WatchedDevice), its own clock of when forces came, and counts datagrams where the network hands them over.
///
/// Thread-safe: no.
class Witness {
 public:
  /// All must outlive it. `simulated` is null when the device is an adversary.
  Witness(const DrawnWorld& drawn, World& world, const WatchedDevice& port, const SimulatedDevice* simulated);

  void see(const StepRecord& step);
  void see(const World::Turn& turn);
  /// Client `handle`, an observer, is shown a state.
  void see_state(std::size_t handle, const DeviceState& state) { seen_[handle] |= state.buttons; }
  /// The weather has just cleared: what was lost before is over. Or a client has died in clear weather.
  void weather_clears(LocalTime last_arrival_of_bad_weather);
  /// From when on everybody must be served; empty before the weather clears.
  std::optional<LocalTime> recovered_by() const { return recovered_by_; }
  /// That time has come.
  void see_recovered();
  /// The world is over.
  void see_end();

  const std::optional<Breach>& breach() const { return breach_; }
  void report(Oracle oracle, std::string what);

  bool felt() const { return felt_; }        ///< a remote force was rendered
  bool limited() const { return limited_; }  ///< … and limited by energy
  bool turned() const { return turned_; }    ///< a torque was given out
  bool gripped() const { return gripped_; }  ///< a grip force was
  /// Presses of buttons that observers had to be shown, and were.
  int presses() const { return presses_; }
  bool checked_recovery() const { return checked_recovery_; }
  /// J, of the port's account, while it owes nothing to holds beyond the law's bound.
  double least_energy() const { return least_energy_; }

 private:
  struct Mark {  ///< of a client, when it had to be recovered
    std::uint64_t sessions = 0;
    std::uint64_t states = 0;
    std::uint64_t arrived = 0;
    std::uint64_t accounted = 0;
  };
  double account() const;
  void see_bounds(const StepRecord& step);
  void see_energy(const StepRecord& step);
  void see_account(const char* whose, double& last, double now, double may_take);
  void see_presses();
  void see_age(const StepRecord& step);
  void see_server();
  void see_clock(const NetworkLoop::Stats& server);
  void see_round_trip(const char* whose, Duration round_trip);
  void see_counters();
  void see_served();

  const DrawnWorld& drawn_;
  World& world_;
  const WatchedDevice& port_;
  const SimulatedDevice* simulated_;
  bool aol_;        ///< one of the family of the AOL
  Duration valid_;  ///< the longest that a force may be fresh
  Duration safe_stop_;
  Duration slew_time_;     ///< from the largest force to none
  bool may_replay_ticks_;  ///< a rogue answers old steps again, or damage makes a force look so

  std::optional<Breach> breach_;
  bool clocks_step_ = false;        ///< of a controller
  std::uint64_t arrived_ = 0;       ///< at the server
  bool server_wants_more_ = false;  ///< since its last turn
  std::uint64_t forces_ = 0;        ///< that the server has handed to the haptic loop
  std::optional<LocalTime> last_force_;
  LocalTime answered_ = LocalTime::min();  ///< when the motion was sampled which the rendered force answers
  std::optional<Duration> silent_for_;     ///< there should be no force, for so long as the slew limit counts it
  double last_account_ = 0;
  double last_grip_ = 0;
  Duration bound_ = Duration::max();  ///< so long the force held now may be held, by the step that chose it
  bool felt_ = false;
  bool limited_ = false;
  bool turned_ = false;
  bool gripped_ = false;
  int presses_ = 0;
  LocalTime began_;
  std::vector<std::uint32_t> seen_;  ///< buttons, by client
  bool checked_recovery_ = false;
  double least_energy_ = std::numeric_limits<double>::infinity();
  std::optional<LocalTime> recovered_by_;
  std::vector<Mark> marks_;
  std::uint64_t forces_then_ = 0;
};

}  // namespace tendon::simulation
