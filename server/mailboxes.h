// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "core/exchange/latest.h"
#include "core/exchange/spsc_ring.h"
#include "core/remote/remote_force.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/shares.h"
#include "protocol/limits.h"
#include "protocol/messages.h"
#include "server/guests/health.h"
#include "server/guests/outputs.h"
#include "server/recording/records.h"
#include "server/recording/step_flight.h"
#include "server/recording/ways.h"

namespace tendon {

/// An order to the haptic thread.
struct HapticOrder {
  enum class Kind : std::uint8_t {
    kRelease,    ///< `source` no longer has `channel`: its force is no longer fresh
    kRearm,      ///< clear the latched fault, and take kDisarm back
    kDisarm,     ///< no force until kRearm
    kEngage,     ///< the operator's act of `coupling`
    kDisengage,  ///< … and its end
    kSetScale,   ///< of `coupling`: `scales`
    kRenew,      ///< the other end of `coupling` is another one: `source` is its number
    kShare,      ///< the leader of `coupling` is to count `share`
  };
  Kind kind = Kind::kRearm;
  std::uint32_t channel = 0;
  std::uint32_t source = 0;
  std::array<double, 2> scales{};  ///< of positions and of forces
  std::uint32_t coupling = 0;      ///< of the device: 0 where it has one
  double share = 0;                ///< 0 … 1
};

/// What the other end of a coupling has told.
struct ArrivedPort {
  PortState state;
  LocalTime at{};          ///< by which it had come
  std::uint32_t peer = 0;  ///< the number of that end among all that the coupling has had
};

/// A Hello that the first network thread has received for a device of another one.
struct HandedHello {
  Address from{};
  std::uint32_t size = 0;
  std::array<std::byte, kMaxDatagram> bytes;
};

/// All that passes between the haptic thread of one device and the other threads of the server. There is nothing else
/// they share, and no lock.
///
///     network ──forces─▶ haptic      one box for each channel; newest wins: an older force is worth nothing
///     network ──orders─▶ haptic      all of them, in order
///     network ─outputs──▶ haptic     lamps and vibration; newest wins: it says all of them
///     network ──port in─▶ haptic     a box for each coupling: the peer's port; newest wins
///     haptic  ──state──▶ network     newest wins
///     haptic  ──port out▶ network    a box for each coupling: this port; newest wins
///     haptic  ──steps──▶ log         all of them, of a server that records; what does not fit is counted
///     haptic  ──ports──▶ log         of a coupling: all of them; what does not fit is counted
///     haptic  ──flight─▶ log         the steps before a fault, frozen by it
///     log     ──health─▶ network     newest wins: what it counts is since the start
///     network ──ways───▶ log         the names of the numbers that forces bring, each written before its first force
///     network ─datagrams▶ log        of all devices, those that DatagramSieve lets through; what it leaves out, and what
///                                    does not fit, is counted
///
/// Takes its memory when it is made, before the loops run.
struct Mailboxes {
  /// In values; powers of two. The default is that of a server which records: some 19 MB.
  struct Capacities {
    std::size_t steps = 16384;  ///< 16 s at 1 kHz: the log thread may wait that long for a slow disk
    std::size_t ports = 1;      ///< of a device with a coupling so many for each of its couplings
    std::size_t flight = 2048;  ///< the last 2 s at 1 kHz
    std::size_t datagrams = 4096;
    bool flight_handles = true;  ///< the device has more than a position

    /// Of one of so many devices in a server that records. The steps of more than 16 have no more room than those of 16
    /// together: 512 steps for each of 512 devices, half a second at 1 kHz.
    static Capacities recorded(std::size_t devices) {
      constexpr Capacities kOfFew;
      const std::size_t share =
          kOfFew.steps * limits::kMaxDevices / std::max<std::size_t>(devices, limits::kMaxDevices);
      return {.steps = std::bit_floor(share), .ports = std::bit_floor(share)};
    }

    /// Of a loop with this period in a server that does not record: nobody takes steps, and the log thread, which waits
    /// for no disk, comes for the ports every 20 ms. A ring of at least 125 ms of these; 0.8 MB in all for a device that
    /// has a position only.
    static Capacities unrecorded(Duration period) {
      const auto ports = static_cast<std::size_t>(std::max<Duration::rep>(std::chrono::milliseconds(125) / period, 1));
      return {.steps = 1, .ports = std::bit_ceil(ports), .datagrams = 1};
    }
  };

  /// Orders that can wait: more than guests come and go within a haptic step.
  static constexpr std::size_t kOrders = 16;

  explicit Mailboxes(const Capacities& capacities)
      : steps(capacities.steps),
        ports(capacities.ports),
        flight(capacities.flight, capacities.flight_handles),
        datagrams(capacities.datagrams) {}
  Mailboxes() : Mailboxes(Capacities{}) {}

  std::array<Latest<RemoteForce>, limits::kMaxChannels> forces;
  SpscRing<HapticOrder> orders{kOrders};
  Latest<DeviceState> state;
  Latest<OutputSettings> outputs;
  std::array<Latest<ArrivedPort>, Shares::kMost> port_in;  ///< by coupling, as port_out
  std::array<Latest<PortState>, Shares::kMost> port_out;
  SpscRing<StepRecord> steps;
  std::atomic<std::uint64_t> steps_lost{0};
  SpscRing<PortRecord> ports;
  std::atomic<std::uint64_t> ports_lost{0};
  StepFlight flight;
  Latest<Health> health;
  Ways ways;  ///< of RemoteForce::way and Step::force_way
  SpscRing<DatagramRecord> datagrams;
  std::atomic<std::uint64_t> datagrams_lost{0};         ///< did not fit
  std::atomic<std::uint64_t> strangers_left_out{0};     ///< datagrams from or to strangers beyond the sample
  std::atomic<std::uint64_t> datagrams_over_budget{0};  ///< beyond the bytes of a second
};

}  // namespace tendon
