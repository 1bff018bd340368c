// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/exchange/latest.h"
#include "core/exchange/spsc_ring.h"
#include "core/field/field_pose.h"
#include "core/remote/field_use.h"
#include "core/remote/remote_force.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/shares.h"
#include "protocol/limits.h"
#include "protocol/messages.h"
#include "server/clients/health.h"
#include "server/clients/outputs.h"
#include "server/recording/records.h"
#include "server/recording/solver_paths.h"
#include "server/recording/step_flight.h"

namespace tendon {

struct HapticOrder {
  enum class Kind : std::uint8_t {
    kRelease,  ///< `source` no longer holds `channel`
    kRearm,    ///< clears the latched fault and ends kDisarm
    kDisarm,   ///< no force until kRearm
    kEngage,
    kDisengage,
    kSetScale,  ///< applies `scales` to `coupling`
    kRenew,     ///< the peer of `coupling` has been replaced; `source` is the number of the new one
    kShare,     ///< sets the weight of the leader of `coupling` to `share`
  };
  Kind kind = Kind::kRearm;
  std::uint32_t channel = 0;
  std::uint32_t source = 0;
  std::array<double, 2> scales{};  ///< position scale, force scale
  std::uint32_t coupling = 0;      ///< index; 0 if the device has only one
  double share = 0;                ///< from 0 to 1
};

/// A state received from the peer of a coupling.
struct ArrivedPort {
  PortState state;
  LocalTime at{};          ///< time of arrival
  std::uint32_t peer = 0;  ///< consecutive number of the peer, see HapticOrder::kRenew
};

/// A field that the haptic thread must use from now on (FieldSlots).
struct PostedField {
  FieldUse use;
  std::uint32_t number = 0;  ///< consecutive for each channel, from 1
};

struct ArrivedPose {
  field::TimedPose pose;
  std::uint32_t source = 0;  ///< as in FieldUse
};

/// The mailboxes of one channel for fields.
struct FieldBox {
  Latest<PostedField> use;
  Latest<ArrivedPose> pose;
  std::atomic<std::uint32_t> taken{0};  ///< number of the newest field that the haptic thread has taken
};

/// The queues for recording the fields of a device.
struct FieldTape {
  SpscRing<FieldInput> inputs{1024};  ///< from the haptic thread, before the step
  std::atomic<std::uint64_t> inputs_lost{0};
  /// From the network thread, before the field can be used. The ring keeps up to eight fields in memory.
  SpscRing<FieldData> data{8};
  std::atomic<std::uint64_t> data_lost{0};
};

/// A Hello that was received by the first network thread and must be processed by another one.
struct HandedHello {
  Address from{};
  std::uint32_t size = 0;
  std::array<std::byte, kMaxDatagram> bytes;
};

/// The data that the haptic thread of one device exchanges with the other threads of the server. There is no other
/// shared state, and no locks are used. server/THREADS.md, "Queues", lists who writes and who reads each of them, and
/// what happens if it is full. The name of a solver path in `ways` is written before the first force with its number.
/// The constructor allocates all memory, before the loops run.
struct Mailboxes {
  /// Numbers of elements, which must be powers of two. The defaults, for a server that records, require about 20 MB.
  struct Capacities {
    std::size_t steps = 16384;  ///< 16 s at 1 kHz, for slow disks
    std::size_t ports = 1;      ///< for each coupling
    std::size_t flight = 2048;  ///< the size of `flight`: 2 s at 1 kHz
    std::size_t datagrams = 4096;
    std::size_t channels = limits::kMaxChannels;  ///< `forces`
    std::size_t couplings = Shares::kMost;        ///< `port_in` and `port_out`
    bool flight_handles = true;                   ///< if false, only positions are stored
    bool fields = false;

    /// For each device of a server that records. For more than 16 devices, the total size of the step queues is the
    /// same as for 16. For example, 512 devices have queues of 512 steps, which is half a second at 1 kHz.
    static Capacities recorded(std::size_t devices) {
      constexpr Capacities kOfFew;
      const std::size_t share =
          kOfFew.steps * limits::kMaxDevices / std::max<std::size_t>(devices, limits::kMaxDevices);
      return {.steps = std::bit_floor(share), .ports = std::bit_floor(share)};
    }

    /// Returns the size of `flight`. More than 128 devices share the memory of 128, so 512 devices keep half a second.
    static std::size_t flight_of(std::size_t devices) {
      constexpr std::size_t kMostDevices = 128;
      return Capacities{}.flight * kMostDevices / std::max(devices, kMostDevices);
    }

    /// For each device of a server that does not record. The steps are not used. The port queue lasts at least 125 ms,
    /// because the log thread only reads it every 20 ms. The total depends on StepFlight: 0.1 to 0.5 MB.
    static Capacities unrecorded(Duration period) {
      const auto ports = static_cast<std::size_t>(std::max<Duration::rep>(std::chrono::milliseconds(125) / period, 1));
      return {.steps = 1, .ports = std::bit_ceil(ports), .datagrams = 1};
    }
  };

  static constexpr std::size_t kOrders = 16;  ///< more than clients can cause within one haptic step

  explicit Mailboxes(const Capacities& capacities)
      : forces(capacities.channels),
        port_in(capacities.couplings),
        port_out(capacities.couplings),
        steps(capacities.steps),
        ports(capacities.ports),
        flight(capacities.flight, capacities.flight_handles, capacities.fields),
        datagrams(capacities.datagrams) {
    if (capacities.fields) fields = std::make_unique<std::array<FieldBox, limits::kMaxChannels>>();
    if (capacities.fields && capacities.steps > 1) field_tape = std::make_unique<FieldTape>();
  }
  Mailboxes() : Mailboxes(Capacities{}) {}

  std::vector<Latest<RemoteForce>> forces;                             ///< of each channel
  std::unique_ptr<std::array<FieldBox, limits::kMaxChannels>> fields;  ///< null if no channel can use fields
  std::unique_ptr<FieldTape> field_tape;  ///< null if no channel can use fields, or if the steps are not recorded
  SpscRing<HapticOrder> orders{kOrders};
  Latest<DeviceState> state;
  Latest<OutputSettings> outputs;
  std::vector<Latest<ArrivedPort>> port_in;
  std::vector<Latest<PortState>> port_out;
  SpscRing<StepRecord> steps;
  std::atomic<std::uint64_t> steps_lost{0};
  SpscRing<PortRecord> ports;
  std::atomic<std::uint64_t> ports_lost{0};
  StepFlight flight;
  Latest<Health> health;
  SolverPaths ways;
  SpscRing<DatagramRecord> datagrams;
  std::atomic<std::uint64_t> datagrams_lost{0};            ///< because the queue was full
  std::atomic<std::uint64_t> unauthenticated_left_out{0};  ///< from unauthenticated senders, not included in the sample
  std::atomic<std::uint64_t> datagrams_over_budget{0};     ///< not recorded because of the limit in bytes per second
};

}  // namespace tendon
