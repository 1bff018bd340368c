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
#include "server/guests/lateness.h"
#include "server/guests/sampled_steps.h"
#include "server/mailboxes.h"

// The values that the network thread's parts share: guests with their seats, devices with their channels.

namespace tendon {

/// What a guest has claimed.
struct Seat {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  Role role = Role::kObserver;
  bool by_name = false;  ///< it may wait for the lease
};

/// A device that a guest sees.
struct View {
  std::uint32_t device = 0;
  std::uint64_t state_every = 1;  ///< haptic steps
  std::uint64_t last_state = 0;   ///< tick
  std::optional<StateDeadband> deadband{};
};

struct Guest {
  Address address;
  ClientRandom random;   ///< of its Hello: the same one again is the same attempt
  const ClientKey* key;  ///< null in suite 0
  std::string name;
  Role role;
  bool can_lose;            ///< it can be told that it has lost a lease
  bool diagnoses;           ///< it was granted kFeatureDiagnostics
  std::vector<Seat> seats;  ///< `role` is what its Welcome says
  std::vector<View> views;
  std::vector<std::byte> answer;  ///< its handshake's, in case the first copy was lost
  Session session;
  LocalTime arrived;
  std::optional<RateAdaptation> adaptation{};
  std::optional<LinkMeter> meter{};  ///< of a controller
  std::uint64_t reports = 0;         ///< sent to it
  std::uint64_t lost = 0;            ///< datagrams, either way, as of the newest force
  std::uint64_t invalid = 0;         ///< its refused frames, as of the last report
  bool hopeless = false;             ///< as it was told to the operator
  bool gone = false;                 ///< erased at the end of the turn; until then nobody hears it

  std::uint32_t id() const noexcept { return session.connection_id(); }
  /// Whether it has claimed this channel as a controller.
  bool sits_on(std::uint32_t device, std::uint32_t channel) const noexcept {
    return std::any_of(seats.begin(), seats.end(), [&](const Seat& seat) {
      return seat.device == device && seat.channel == channel && seat.role == Role::kController;
    });
  }
};

struct ServedChannel {
  std::uint32_t holder = 0;  ///< connection id; 0 = nobody
  LocalTime renewed{};       ///< by the newest force that was handed on, or when its holder came
  std::uint64_t forces = 0;
  std::uint64_t handovers = 0;
  std::uint64_t late = 0;
  Lateness lateness{};
  Lateness::Report newest{};  ///< of `lateness`
  std::uint64_t reports = 0;  ///< of its engine, to observers
};

struct ServedDevice {
  DeviceDescription about;
  Mailboxes* mail = nullptr;
  SampledSteps sampled{};
  std::vector<ServedChannel> channels{};
  std::optional<Health> told{};  ///< to observers, last; empty before the first
  std::uint64_t reports = 0;     ///< told so far
};

/// The present guest that holds `channel`; null: nobody. `guests` is a container of Guest, const or not.
template <class Guests>
auto holder_of(Guests& guests, const ServedChannel& channel) -> decltype(&*guests.begin()) {
  if (channel.holder == 0) return nullptr;
  const auto found = std::find_if(guests.begin(), guests.end(),
                                  [&](const Guest& guest) { return !guest.gone && guest.id() == channel.holder; });
  return found == guests.end() ? nullptr : &*found;
}

}  // namespace tendon
