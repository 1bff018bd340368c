// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/handshake.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/narrow/deadband.h"
#include "protocol/narrow/link_meter.h"
#include "protocol/narrow/rate_adaptation.h"
#include "protocol/session.h"
#include "server/guests/features.h"
#include "server/guests/health.h"
#include "server/guests/lateness.h"
#include "server/guests/peer.h"
#include "server/guests/sampled_steps.h"
#include "server/mailboxes.h"

// What the network thread knows of its guests, and of the devices that they come for. These are values; NetworkLoop,
// Admission, Leases and Reports act on them.

namespace tendon {

/// Devices of a server: 64 banks. Here a device is known by its place among all of them. A session has numbers for 16
/// devices, those of one bank, in their order (WIRE.md, "Devices and channels").
inline constexpr std::size_t kMostDevices = 1024;
constexpr std::uint32_t bank_of(std::uint32_t device) { return device / limits::kMaxDevices; }
constexpr std::uint32_t number_of(std::uint32_t device) { return device % limits::kMaxDevices; }

/// One of the network loops that share the devices of a server, each with its own thread, socket and sessions.
///
/// Its devices are whole banks, one after the other: of B banks those from ⌊B · number / of⌋ up to, and not with,
/// ⌊B · (number + 1) / of⌋. The connection ids of its sessions are `number` modulo `of`.
struct Shard {
  std::uint32_t number = 0;
  std::uint32_t of = 1;  ///< a power of two, no more than banks

  /// The place of its first device among all of so many; that of the next shard's first one is where it ends.
  std::size_t first_device(std::size_t devices) const noexcept { return start_of(number, devices); }
  std::size_t end_device(std::size_t devices) const noexcept { return start_of(number + 1, devices); }

  /// The number of the shard that has this one of so many devices.
  std::uint32_t owner_of(std::size_t device, std::size_t devices) const noexcept {
    std::uint32_t owner = 0;
    while (device >= start_of(owner + 1, devices)) ++owner;
    return owner;
  }

 private:
  std::size_t start_of(std::uint32_t shard, std::size_t devices) const noexcept {
    const std::size_t banks = (devices + limits::kMaxDevices - 1) / limits::kMaxDevices;
    return std::min(banks * shard / of * limits::kMaxDevices, devices);
  }
};

/// A place that a guest has claimed.
struct Seat {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  Role role = Role::kObserver;
  bool by_name = false;  ///< it may wait for the lease
};

/// A device whose states a guest gets.
struct View {
  std::uint32_t device = 0;
  std::uint64_t state_every = 1;  ///< haptic steps
  std::uint64_t last_state = 0;   ///< tick
  std::optional<StateDeadband> deadband{};
  std::uint32_t pressed = 0;  ///< buttons that were held at any time since the last state
  /// Of a coupling of the device.
  struct Ports {
    LocalTime due{};          ///< its ends are told again, at the earliest
    bool peer_waits = false;  ///< the other end has told something since then
  };
  std::array<Ports, Shares::kMost> ports{};
};

/// Somebody with a session.
struct Guest {
  Address address;
  ClientRandom random;   ///< of its Hello: the same one again is the same attempt
  const ClientKey* key;  ///< null in suite 0
  std::string name;
  Role role;
  Features features;
  std::vector<std::string> ways;  ///< in which it answers, of its Hello; empty: it has not asked for kFeatureWays
  std::vector<Seat> seats;        ///< `role` is what its Welcome says
  std::vector<View> views;        ///< at least one; all of one bank
  std::vector<std::byte> answer;  ///< to its Hello, for when it was lost
  Session session;
  LocalTime arrived;
  std::optional<RateAdaptation> adaptation{};
  std::optional<LinkMeter> meter{};  ///< of a controller
  std::uint64_t reports = 0;         ///< sent to it
  std::uint64_t lost = 0;            ///< datagrams, either way, as of the newest force
  RefusedForces refused{};           ///< since its session opened
  RefusedForces refused_told{};      ///< … as of the newest report
  bool hopeless = false;             ///< as it was told to the operator
  std::optional<Seat> coupled{};     ///< its device is the other end of this one, while it holds that channel
  bool gone = false;                 ///< it has left, and is forgotten at the end of the turn

  std::uint32_t id() const noexcept { return session.connection_id(); }
  template <const std::string_view& feature>
  bool has() const noexcept {
    return features.has<feature>();
  }
  /// True if the guest can be the other end of a coupling.
  bool may_couple() const noexcept { return has<kFeatureTeleoperation>() && role == Role::kController; }
  /// True if the guest observes both ends of a coupling.
  bool sees_ports() const noexcept { return has<kFeatureTeleoperation>() && role == Role::kObserver; }
  /// The device that its session calls by this number; of a last bank that is not full it may not exist.
  std::uint32_t device_of(std::uint32_t number) const noexcept {
    return bank_of(views.front().device) * limits::kMaxDevices + number;
  }
  /// It does not hold the channel any more.
  void uncouple(std::uint32_t device, std::uint32_t channel) noexcept {
    if (coupled && coupled->device == device && coupled->channel == channel) coupled.reset();
  }
};

/// Whether the guest has claimed the channel as a controller.
bool sits_on(const Guest& guest, std::uint32_t device, std::uint32_t channel);

/// Whether the guest has claimed a channel of the device as a controller.
bool controls(const Guest& guest, std::uint32_t device);

/// The guest's view of the device; null when it has none.
View* view_of(Guest& guest, std::uint32_t device);

/// The present guest of that connection id; null when there is none.
Guest* guest_of(std::vector<Guest>& guests, std::uint32_t id);
const Guest* guest_of(const std::vector<Guest>& guests, std::uint32_t id);

/// Where the forces of one engine come in.
struct ServedChannel {
  std::uint32_t holder = 0;  ///< connection id of the guest whose forces it takes; 0 = nobody's
  LocalTime renewed{};       ///< by the newest force that was handed on, or when the holder came
  std::uint64_t forces = 0;
  std::uint64_t handovers = 0;
  std::uint64_t late = 0;
  Lateness lateness;
  Lateness::Report newest;    ///< of it
  std::uint64_t reports = 0;  ///< of its engine, to observers
  /// What its engines say of how good their forces are.
  struct Doubt {
    std::optional<double> error{};  ///< N; empty: none has said any
    std::uint8_t way = 0;           ///< by Mailboxes::ways, of the force with that error, or else of the newest
    void observe(const std::optional<double>& said, std::uint8_t by) noexcept {
      if (!said ? error.has_value() : error && *said < *error) return;
      error = said;
      way = by;
    }
  };
  Doubt doubt{};                        ///< of the present holder, since the newest report
  std::optional<double> worst_error{};  ///< N, of all; empty: none has said any
  std::vector<std::uint64_t> by_way{};  ///< forces by the number of their way; shorter: of the others there are none
};

/// A device, as guests meet it.
struct ServedDevice {
  struct Config {
    DeviceDescription about;  ///< its number and the `holder` of its channels are ignored
    HandleDescription handle{};
    std::optional<Couple> coupling{};  ///< empty if the device cannot be coupled
    /// If a follower has several leaders, each of them uses one of these channels. Empty: one leader on any channel.
    std::vector<std::uint32_t> leaders{};
    std::optional<Peer::Config> dial{};  ///< the server of the other end, if this server connects to it
    Mailboxes* mail = nullptr;           ///< must outlive the loop
  };

  DeviceDescription about;  ///< with its number in a session, as `handle`
  HandleDescription handle;
  Mailboxes* mail;
  SampledSteps sampled{};
  std::vector<ServedChannel> channels{};
  std::optional<Couple> coupling{};     ///< what our end is like; empty: it is not to be coupled
  PortPhase phase = PortPhase::kAlone;  ///< of our end, as its loop told it last; of several the newest told
  /// The channels by which its leaders come, in the order of its couplings; empty: it has one coupling, by any channel.
  std::vector<std::uint32_t> leaders{};
  std::array<std::uint32_t, Shares::kMost> peers{};   ///< by coupling: how many other ends it has had
  std::array<PortFrame, Shares::kMost> peer_ports{};  ///< by coupling: what the other end told last, for observers
  Outputs outputs{};
  std::optional<Health> told{};  ///< to observers, last; empty before there was any
  std::uint64_t reports = 0;     ///< told so far
};

/// The coupling of the device that comes by this channel; empty: none does.
std::optional<std::uint32_t> coupling_by(const ServedDevice& device, std::uint32_t channel);

/// The coupling has another end from now on: its loop forgets the one before. False when there is no room for the
/// order.
bool renew_peer(ServedDevice& device, std::uint32_t coupling);

/// Returns the devices of one shard. Throws std::invalid_argument if the number of devices or
/// channels is out of range, two of them share a name, a device has no mailboxes, or there is no such shard.
std::vector<ServedDevice> served_devices(const std::vector<ServedDevice::Config>& all, const Shard& shard = {});

}  // namespace tendon
