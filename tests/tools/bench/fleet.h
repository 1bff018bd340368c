// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"
#include "tests/tools/injector/proxy/duration_histogram.h"

namespace tendon::bench {

/// `tendond` with many simulated devices, and the process of its guests, over UDP on the loopback.
///
/// The server is the program itself, with a scene that counts its devices. A device moves in one substep for each step:
/// it stands for hardware, and is not what is measured.
///
/// The guests are one thread of another process with the client's half of the protocol; they answer states with
/// forces. They cost these cores as much as the server does.
struct Fleet {
  std::size_t devices = 16;
  std::size_t channels = 1;  ///< of each device
  /// One session that controls all devices of a bank; otherwise one for each channel.
  bool one_session_for_16 = false;
  /// … as many as that, the first ones; those beyond the channels are observers of one device each. 0: all.
  std::size_t sessions = 0;
  std::uint32_t state_hz = 1000;
  std::uint32_t force_hz = 1000;
  bool recorded = false;                             ///< every step, to a file
  Duration settle = std::chrono::milliseconds(300);  ///< after the last session has opened
  Duration length = std::chrono::seconds(2);         ///< and until a state has come
  std::uint64_t seed = 1;
  /// Of the guests and of the server's other threads, where it is not 0; its haptic threads ask for their own.
  int priority = 0;
};

struct FleetResult {
  std::size_t sessions = 0;
  std::size_t controllers = 0;
  bool all_came = false;  ///< every session was open when it began
  double seconds = 0;     ///< that it lasted

  // Of the whole run:
  Duration started{};          ///< from exec to listening
  std::uint64_t resident = 0;  ///< bytes, of the server
  std::uint64_t steps = 0;     ///< of all devices
  std::uint64_t overruns = 0;  ///< of them, after an interval longer than the bound assumed
  std::uint64_t forces_sent = 0;
  std::uint64_t forces_taken = 0;  ///< handed to the haptic loops
  std::uint64_t lost_steps = 0;    ///< of a recording

  // While it was measured:
  injector::DurationHistogram loop_age;   ///< of a state: since the motion that the force in use answers
  injector::DurationHistogram state_age;  ///< when the guest's kernel had a state − when it was sampled
  std::uint64_t states_owed = 0;
  std::uint64_t states_received = 0;
  /// The strict measure: steps of which the guest was told that their force answers the motion of the step before, less
  /// than 1.5 periods old. So the state came to its guest, and the force back, within a period.
  std::uint64_t answered_in_time = 0;
  std::uint64_t steps_owed = 0;     ///< of all devices
  std::uint64_t out_datagrams = 0;  ///< server → guests
  std::uint64_t out_bytes = 0;
  std::uint64_t in_datagrams = 0;
  std::uint64_t in_bytes = 0;
  std::uint64_t lost = 0;  ///< of both ways, on the way

  // Processor time:
  Duration haptic{};
  Duration network{};
  Duration log{};  ///< and all else of the server
  Duration guests{};
};

/// Throws std::runtime_error when the system refuses sockets, processes or memory, and when there is no `tendond` beside
/// this program. Forks: call it while there is one thread.
FleetResult run_fleet(const Fleet& fleet);

}  // namespace tendon::bench
