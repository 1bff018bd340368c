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

/// Why somebody does not come in.
struct Refusal {
  Code code;
  std::string reason;
};

/// Decides who comes in, and which seats they get (SESSION.md, "Opening"). It changes nothing.
///
/// Thread-safe: no. Realtime-safe: no.
class Admission {
 public:
  struct Config {
    std::size_t keys = 0;  ///< of the server; 0: it lets in whoever comes, in the clear
    bool (*needs_no_key)(const Address& from) noexcept = nullptr;  ///< see NetworkLoop::Config
    std::size_t max_observers = 8;  ///< where there are several keys, one key has at most half of them, rounded up
  };

  explicit Admission(const Config& config) : config_(config) {}

  /// The seats that a Hello claims; refused when it claims what is not there, the same twice, devices of two banks, or a
  /// role that is not the highest among its claims.
  static std::variant<std::vector<Seat>, Refusal> seats_of(const Hello& hello,
                                                           const std::vector<ServedDevice::Config>& devices);

  /// Why a guest at `from` with `key` (null: none) may not take these seats now; empty: it may.
  std::optional<Refusal> reason_to_refuse(const Address& from, const ClientKey* key, const std::vector<Seat>& seats,
                                          const std::vector<ServedDevice>& devices,
                                          const std::vector<Guest>& guests) const;

  /// Whether somebody at `from` with `key` is the same program as `present`, started again.
  static bool takes_the_place_of(const Guest& present, const Address& from, const ClientKey* key,
                                 const std::vector<Seat>& seats);

  /// What a guest is told that may come in.
  static Welcome welcome_for(const Doorman::Guest& guest, const Address& from, const std::vector<Seat>& seats,
                             const std::vector<ServedDevice>& devices, const std::vector<Guest>& guests);

  /// One view of each device among the seats.
  static std::vector<View> views_of(const std::vector<Seat>& seats);

 private:
  Config config_;
};

}  // namespace tendon
