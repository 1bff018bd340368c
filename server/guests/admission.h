// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/handshake.h"
#include "server/guests/guest.h"

namespace tendon {

struct Refusal {
  Code code;
  std::string reason;
};

/// Decides who may come in, and to which seats. It changes nothing: NetworkLoop acts on its answers.
///
/// Thread-safe: no. Realtime-safe: no.
class Admission {
 public:
  struct Config {
    std::size_t keys = 0;           ///< how many there are; above zero, guests without a key are refused
    std::size_t max_observers = 8;  ///< of one key at most half, rounded up, where there are several keys
  };

  /// `devices` and `guests` must outlive it.
  Admission(const Config& config, const std::vector<ServedDevice>& devices, const std::vector<Guest>& guests)
      : config_(config), devices_(devices), guests_(guests) {}

  /// The numbers of the devices and channels that `hello` claims by name, or why there are no such seats.
  std::variant<std::vector<Seat>, Refusal> seats_of(const Hello& hello) const;

  /// Why a guest with these seats may not come in now; empty when it may.
  std::optional<Refusal> reason_to_refuse(const Address& from, const ClientKey* key,
                                          const std::vector<Seat>& seats) const;

  /// Whether `present` is the same program, started again: it has the same key and the same address, or the same key
  /// and one of the seats as a controller.
  static bool takes_the_place_of(const Guest& present, const Address& from, const ClientKey* key,
                                 const std::vector<Seat>& seats);

  /// What each seat is granted now: a held channel only as an observer. Seats that were not claimed by name are left out.
  std::vector<Grant> grants_of(const Address& from, const ClientKey* key, const std::vector<Seat>& seats) const;

 private:
  Config config_;
  const std::vector<ServedDevice>& devices_;
  const std::vector<Guest>& guests_;
};

/// Throws std::invalid_argument when there is no device, more than limits::kMaxDevices, a device without a channel or
/// with more than limits::kMaxChannels, or when two of them share a name.
void check_devices(const std::vector<DeviceDescription>& devices);

}  // namespace tendon
