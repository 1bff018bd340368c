// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"
#include "tests/tools/injector/proxy/duration_histogram.h"

namespace tendon::bench {

/// Measures the real `tendond` with many simulated devices. The clients are in another process, and UDP on the loopback
/// is used. The devices only use one substep per step, so that their cost does not affect the measurement.
///
/// The clients are a single thread, which answers each state. Its load is about the same as that of the server.
struct Fleet {
  std::size_t devices = 16;
  std::size_t channels = 1;  ///< per device
  /// If this is true, one session controls all devices of a bank. Otherwise, each channel has its own session.
  bool one_session_for_16 = false;
  /// If this is 0, there is one session for each device or channel. Additional sessions observe one device each.
  std::size_t sessions = 0;
  std::uint32_t state_hz = 1000;
  std::uint32_t force_hz = 1000;
  bool recorded = false;                             ///< records every step to a file
  Duration settle = std::chrono::milliseconds(300);  ///< time to wait after the last session has been opened
  Duration length = std::chrono::seconds(2);         ///< of the measurement, extended until a state arrives
  std::uint64_t seed = 1;
  /// SCHED_FIFO priority of the clients and of all non-haptic threads of the server. 0: the default scheduling.
  int priority = 0;
};

struct FleetResult {
  std::size_t sessions = 0;
  std::size_t controllers = 0;
  bool all_came = false;  ///< true if all sessions were open at the start
  double seconds = 0;     ///< measured duration

  Duration started{};          ///< time from exec until the server listens
  std::uint64_t resident = 0;  ///< resident memory of the server, bytes
  std::uint64_t steps = 0;     ///< of all devices
  std::uint64_t overruns = 0;  ///< steps after an interval longer than the assumed bound
  std::uint64_t forces_sent = 0;
  std::uint64_t forces_taken = 0;  ///< forces that reached the haptic loops
  std::uint64_t lost_steps = 0;    ///< steps missing in a recording

  injector::DurationHistogram loop_age;   ///< for each state: age of the motion that its force answers
  injector::DurationHistogram state_age;  ///< receive time in the client's kernel − sample time
  std::uint64_t states_owed = 0;
  std::uint64_t states_received = 0;
  /// The number of steps whose force answers the motion of the previous step, which is less than 1.5 periods old.
  std::uint64_t answered_in_time = 0;
  std::uint64_t steps_owed = 0;
  std::uint64_t out_datagrams = 0;  ///< server → clients
  std::uint64_t out_bytes = 0;
  std::uint64_t in_datagrams = 0;
  std::uint64_t in_bytes = 0;
  std::uint64_t lost = 0;  ///< lost in transit, both directions

  Duration haptic{};
  Duration network{};
  Duration log{};  ///< rest of the server
  Duration guests{};
};

/// Throws std::runtime_error if the system refuses sockets, processes or memory, or if there is no `tendond` next to
/// this program. It forks, so it must be called while there is only one thread.
FleetResult run_fleet(const Fleet& fleet);

}  // namespace tendon::bench
