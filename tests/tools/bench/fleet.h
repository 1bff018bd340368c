// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"
#include "tests/tools/injector/proxy/duration_histogram.h"

namespace tendon::bench {

/// A process with many devices and sessions, and the process of its guests, over UDP on the loopback.
///
/// The host is made of the parts that tendond is made of: a HapticLoop and a simulated device for each device, a
/// NetworkLoop with a UdpLink for every 16 of them (limits::kMaxDevices), sessions, sealing. What tendond does not do:
/// one haptic thread takes all devices' steps one after the other, one network thread turns all network loops, and a
/// third thread takes the records out and drops them. A device moves in one substep for each step: it stands for
/// hardware, and is not what is measured.
///
/// The guests are one thread of another process with the client's half of the protocol; they answer states with
/// forces. They cost these cores as much as the host does.
struct Fleet {
  std::size_t devices = 16;
  std::size_t channels = 1;  ///< of each device
  /// One session that controls all devices of its server; otherwise one for each channel.
  bool one_session_for_16 = false;
  /// … as many as that, the first ones; those beyond the channels are observers of one device each. 0: all.
  std::size_t sessions = 0;
  std::uint32_t state_hz = 1000;
  std::uint32_t force_hz = 1000;
  bool sealed = true;
  Duration settle = std::chrono::milliseconds(300);  ///< after the last session has opened
  Duration length = std::chrono::seconds(2);         ///< and until a state has come
  std::uint64_t seed = 1;
  /// Of the network thread and the guests, where it is not 0; the haptic thread asks for its own.
  int priority = 0;
};

struct FleetResult {
  std::size_t sessions = 0;
  std::size_t controllers = 0;
  bool all_came = false;  ///< every session was open when it began
  double seconds = 0;     ///< that it lasted

  std::uint64_t rounds = 0;               ///< of the haptic thread, one step of each device
  std::uint64_t missed = 0;               ///< periods in which there was none
  injector::DurationHistogram late;       ///< when a round began − when it was due
  injector::DurationHistogram round;      ///< how long it took
  injector::DurationHistogram loop_age;   ///< at each step: since the motion was sampled that the force in use answers
  injector::DurationHistogram state_age;  ///< when the guest's kernel had a state − when it was sampled

  std::uint64_t states_owed = 0;
  std::uint64_t states_received = 0;
  std::uint64_t forces_owed = 0;
  std::uint64_t forces_taken = 0;
  /// The strict measure: steps whose force answers the motion of the step before, less than 1.5 periods old. So the state
  /// came to its guest, and the force back, within a period.
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
  Duration log{};
  Duration guests{};
};

/// Throws std::runtime_error when the system refuses sockets, threads or memory. Forks: call it while there is one
/// thread.
FleetResult run_fleet(const Fleet& fleet);

}  // namespace tendon::bench
