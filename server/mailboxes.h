// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "core/flight_recorder.h"
#include "core/latest.h"
#include "core/remote_force.h"
#include "core/spsc_ring.h"
#include "protocol/messages.h"
#include "server/records.h"

namespace tendon {

/// Orders to the haptic thread.
enum class HapticOrder : std::uint8_t {
  kRelease,  ///< the controller has left: its force is no longer fresh
  kRearm,    ///< clear the latched fault
};

/// All that passes between the threads of the server. There is nothing else they share, and no lock.
///
///     network ──force──▶ haptic      newest wins; an older force is worth nothing
///     network ──orders─▶ haptic      all of them, in order
///     haptic  ──state──▶ network     newest wins
///     haptic  ──steps──▶ log         all of them; what does not fit is counted
///     haptic  ──flight─▶ log         the steps before a fault, frozen by it
///     network ─datagrams▶ log        all of them; what does not fit is counted
///
/// Large (some 9 MB): make it on the heap, before the loops run.
struct Mailboxes {
  Latest<RemoteForce> force;
  SpscRing<HapticOrder, 16> orders;
  Latest<DeviceState> state;
  SpscRing<StepRecord, 16384> steps;  ///< 16 s at 1 kHz: the log thread may wait that long for a slow disk
  std::atomic<std::uint64_t> steps_lost{0};
  FlightRecorder<StepRecord, 2048> flight;  ///< the last 2 s at 1 kHz
  SpscRing<DatagramRecord, 4096> datagrams;
  std::atomic<std::uint64_t> datagrams_lost{0};
};

}  // namespace tendon
