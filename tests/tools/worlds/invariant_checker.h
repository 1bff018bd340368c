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

struct Breach {
  Oracle oracle{};
  LocalTime at{};
  std::string what;
};

/// After the network has cleared, the last datagram of the bad period has arrived and the last client has been killed,
/// every living client is served again within
///
///     2 s          timeout of a session that only one end still holds (Session::Config::timeout)
///   + retry_max    the client's longest wait before a retry (ForceClient::Config)
///   + 600 ms       two Hellos and their answers, repeated every 100 ms, then the first state and force
Duration recovery_promise(const DrawnWorld& world);

/// Keeps the first violation. Observes independently of the code under test where possible: energy at the port
/// (WatchedDevice), arrival times of forces, and datagrams counted at the network. Thread-safe: no.
class InvariantChecker {
 public:
  /// All arguments must outlive this object. `simulated` is null for an adversary.
  InvariantChecker(const DrawnWorld& drawn, World& world, const WatchedDevice& port, const SimulatedDevice* simulated);

  void see(const StepRecord& step);
  void see(const World::Turn& turn);
  void see_state(std::size_t handle, const DeviceState& state) { seen_[handle] |= state.buttons; }
  /// Call when the network has cleared or a client was killed on a good network.
  void weather_clears(LocalTime last_arrival_of_bad_weather);
  /// Deadline for every client to be served; empty before the network clears.
  std::optional<LocalTime> recovered_by() const { return recovered_by_; }
  void see_recovered();
  void see_end();

  const std::optional<Breach>& breach() const { return breach_; }
  void report(Oracle oracle, std::string what);

  bool felt() const { return felt_; }        ///< a remote force was rendered
  bool limited() const { return limited_; }  ///< a remote force was limited by energy
  bool turned() const { return turned_; }    ///< a torque was commanded
  bool gripped() const { return gripped_; }  ///< a grip force was commanded
  int presses() const { return presses_; }
  bool checked_recovery() const { return checked_recovery_; }
  /// The minimum of the port's account, J, without deficits because of holds longer than the law's bound.
  double least_energy() const { return least_energy_; }

 private:
  struct Mark {  ///< counters of a client at its recovery deadline
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
  bool aol_;        ///< the law is of the AOL family
  Duration valid_;  ///< longest validity of a force
  Duration safe_stop_;
  Duration slew_time_;     ///< from the maximum force to zero
  bool may_replay_ticks_;  ///< a rogue or bit flips may repeat answers to old steps

  std::optional<Breach> breach_;
  bool clocks_step_ = false;        ///< a controller's clock has steps
  std::uint64_t arrived_ = 0;       ///< datagrams at the server
  bool server_wants_more_ = false;  ///< since its last turn
  std::uint64_t forces_ = 0;        ///< forces passed to the haptic loop
  std::optional<LocalTime> last_force_;
  LocalTime answered_ = LocalTime::min();  ///< sample time of the motion that the rendered force answers
  std::optional<Duration> silent_for_;     ///< time without a fresh force, as the slew limit counts it
  double last_account_ = 0;
  double last_grip_ = 0;
  Duration bound_ = Duration::max();  ///< longest hold assumed when the current force was chosen
  bool felt_ = false;
  bool limited_ = false;
  bool turned_ = false;
  bool gripped_ = false;
  int presses_ = 0;
  LocalTime began_;
  std::vector<std::uint32_t> seen_;  ///< buttons shown to each client
  bool checked_recovery_ = false;
  double least_energy_ = std::numeric_limits<double>::infinity();
  std::optional<LocalTime> recovered_by_;
  std::vector<Mark> marks_;
  std::uint64_t forces_then_ = 0;
};

}  // namespace tendon::simulation
