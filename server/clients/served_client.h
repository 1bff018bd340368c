// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/bandwidth/deadband.h"
#include "protocol/bandwidth/link_meter.h"
#include "protocol/bandwidth/rate_adaptation.h"
#include "protocol/handshake.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/session.h"
#include "server/clients/features.h"
#include "server/clients/health.h"
#include "server/clients/lateness.h"
#include "server/clients/peer.h"
#include "server/clients/sampled_steps.h"
#include "server/mailboxes.h"

namespace tendon {

/// The maximum number of devices of a server, which is 64 banks. All devices of a session must be in the same bank. The
/// number of a device in a session is its index in the bank (WIRE.md, "Devices and channels").
inline constexpr std::size_t kMostDevices = 1024;
constexpr std::uint32_t bank_of(std::uint32_t device) { return device / limits::kMaxDevices; }
constexpr std::uint32_t number_of(std::uint32_t device) { return device % limits::kMaxDevices; }

/// Identifies one of the network loops of a server. Each of them has its own thread, socket and sessions.
///
/// If there are B banks, the devices of a shard are the banks from ⌊B · number / of⌋ to ⌊B · (number + 1) / of⌋ − 1.
/// The connection ids of its sessions are equal to `number` modulo `of`.
struct Shard {
  std::uint32_t number = 0;
  std::uint32_t of = 1;  ///< a power of two; at most the number of banks

  std::size_t first_device(std::size_t devices) const noexcept { return start_of(number, devices); }
  std::size_t end_device(std::size_t devices) const noexcept { return start_of(number + 1, devices); }

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

/// A channel that was claimed by a controller, or a device that was claimed by an observer.
struct Slot {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  Role role = Role::kObserver;
  bool by_name = false;  ///< claimed by its name, so that it can wait for the lease
};

struct Subscription {
  std::uint32_t device = 0;
  std::uint64_t state_every = 1;  ///< in haptic steps
  std::uint64_t last_state = 0;   ///< tick
  std::optional<StateDeadband> deadband{};
  std::uint32_t pressed = 0;  ///< buttons that were pressed since the last state
  struct Ports {
    LocalTime due{};
    bool peer_waits = false;  ///< there is a new port of the peer
  };
  std::array<Ports, Shares::kMost> ports{};
};

struct ServedClient {
  Address address;
  ClientRandom random;   ///< from the Hello, to detect repeated Hellos
  const ClientKey* key;  ///< null if the session is not encrypted
  std::string name;
  Role role;
  Features features;
  std::vector<std::string> ways;            ///< from the Hello, if kFeatureWays is enabled
  std::vector<Slot> slots;                  ///< `role` may have been changed by the Welcome
  std::vector<Subscription> subscriptions;  ///< not empty; all devices are in the same bank
  std::vector<std::byte> answer;            ///< the reply to the Hello, which may have to be repeated
  Session session;
  LocalTime arrived;
  std::optional<RateAdaptation> adaptation{};
  std::optional<LinkMeter> meter{};  ///< only for controllers
  std::uint64_t reports = 0;
  std::uint64_t lost = 0;            ///< lost datagrams in both directions at the newest force
  RefusedForces refused{};           ///< since the session was opened
  RefusedForces refused_reported{};  ///< at the time of the last report
  bool unusable = false;             ///< as last logged
  std::optional<Slot> coupled{};     ///< set if it is the peer of a coupling
  bool gone = false;                 ///< removed at the end of the turn

  std::uint32_t id() const noexcept { return session.connection_id(); }
  template <const std::string_view& feature>
  bool has() const noexcept {
    return features.has<feature>();
  }
  bool may_couple() const noexcept { return has<kFeatureTeleoperation>() && role == Role::kController; }
  bool sees_ports() const noexcept { return has<kFeatureTeleoperation>() && role == Role::kObserver; }
  /// Converts the number of a device in a session to an index. In the last bank, the device may not exist.
  std::uint32_t device_of(std::uint32_t number) const noexcept {
    return bank_of(subscriptions.front().device) * limits::kMaxDevices + number;
  }
  void uncouple(std::uint32_t device, std::uint32_t channel) noexcept {
    if (coupled && coupled->device == device && coupled->channel == channel) coupled.reset();
  }
};

bool holds_slot(const ServedClient& client, std::uint32_t device, std::uint32_t channel);

bool controls(const ServedClient& client, std::uint32_t device);

Subscription* subscription_to(ServedClient& client, std::uint32_t device);

ServedClient* client_of(std::vector<ServedClient>& clients, std::uint32_t id);
const ServedClient* client_of(const std::vector<ServedClient>& clients, std::uint32_t id);

struct ServedChannel {
  std::uint32_t holder = 0;  ///< connection id; 0 if free
  LocalTime renewed{};       ///< by the newest force or when the holder was changed
  std::uint64_t forces = 0;
  std::uint64_t handovers = 0;
  std::uint64_t late = 0;
  Lateness lateness;
  Lateness::Report newest;
  std::uint64_t reports = 0;
  struct Doubt {
    std::optional<double> error{};  ///< N
    std::uint8_t way = 0;           ///< index in Mailboxes::ways
    void observe(const std::optional<double>& said, std::uint8_t by) noexcept {
      if (!said ? error.has_value() : error && *said < *error) return;
      error = said;
      way = by;
    }
  };
  Doubt doubt{};                        ///< since the last report or the last change of the holder
  std::optional<double> worst_error{};  ///< N
  std::vector<std::uint64_t> by_way{};  ///< by index in Mailboxes::ways
};

/// For a device whose scene has [field].
struct FieldLimits {
  std::vector<bool> allowed{};  ///< for each channel
  double max_stiffness = 0;     ///< N/m, maximum stiffness of a material with its branch, and of a fixture
  std::size_t cache_bytes = 0;  ///< of the network thread
};

struct ServedDevice {
  struct Config {
    DeviceDescription about;  ///< device number and holders are ignored
    HandleDescription handle{};
    std::optional<Couple> coupling{};
    std::vector<std::uint32_t> leaders{};  ///< channels of a follower's leaders; empty: the leader can use any
    std::optional<Peer::Config> dial{};    ///< the server to connect to, if any
    std::optional<FieldLimits> fields{};   ///< requires Mailboxes::fields
    Mailboxes* mail = nullptr;             ///< must outlive the loop
  };

  DeviceDescription about;  ///< `device` is the number in a session
  HandleDescription handle;
  Mailboxes* mail;
  SampledSteps sampled{};
  std::vector<ServedChannel> channels{};
  std::optional<Couple> coupling{};      ///< our configuration; empty if the device cannot be coupled
  PortPhase phase = PortPhase::kAlone;   ///< the newest phase of any coupling
  std::vector<std::uint32_t> leaders{};  ///< channel of each leader; empty if there is one leader, on any channel
  std::array<std::uint32_t, Shares::kMost> peers{};   ///< number of peers so far for each coupling
  std::array<PortFrame, Shares::kMost> peer_ports{};  ///< last port of the peer for each coupling
  std::optional<FieldLimits> fields{};                ///< empty if no channel can use fields
  Outputs outputs{};
  std::optional<Health> told{};  ///< the last report to observers
  std::uint64_t reports = 0;
};

std::optional<std::uint32_t> coupling_by(const ServedDevice& device, std::uint32_t channel);

/// Notifies the haptic loop of a new peer of the coupling. Returns false if the queue is full.
bool renew_peer(ServedDevice& device, std::uint32_t coupling);

/// Returns the devices of one shard. Throws std::invalid_argument if the number of devices or channels is out of range,
/// if two of them have the same name, if a device has no mailboxes, or if the shard is not valid.
std::vector<ServedDevice> served_devices(const std::vector<ServedDevice::Config>& all, const Shard& shard = {});

}  // namespace tendon
