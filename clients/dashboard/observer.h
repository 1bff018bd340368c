// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "clients/dashboard/board.h"
#include "protocol/connection.h"
#include "protocol/link.h"
#include "protocol/secrets/crypto.h"
#include "protocol/session.h"

namespace tendon::dash {

/// Observes all devices of a Tendon server, or one group of up to 16 devices of a large server, in one session and
/// writes the changes to a Board. It never sends forces and has no socket, clock or thread.
///
///     Observer observer(link, server, config, board, now);
///     for (;;) wait for a datagram, at most until observer.turn(now);
///
/// A client can only see the devices that it has claimed by name. It finds their names by requesting the descriptions
/// of devices 0, 1, 2 … until there is none. If a server has several devices, the first session therefore requests the
/// names and the second session claims all devices.
///
/// * **Reconnection.** It reconnects indefinitely (see Connection).
/// * **Handles.** It requests each HandleDescription once per session if the server supports kFeatureHandle.
/// * **Holders.** It requests each description again every `describe_every`, because engines may change.
///
/// Thread-safe: no. Realtime-safe: no.
class Observer {
 public:
  struct Config {
    std::string name = "tendon-dash";  ///< for the log of the server; at most limits::kMaxName bytes
    /// Name of one device in the group to observe, since a session is limited to 16 devices. Empty: the first group.
    /// If the server has no such device, it refuses and lists its devices.
    std::string device{};
    std::vector<Address> further{};  ///< alternative addresses of the server, tried if there is no answer
    std::optional<Key> key{};        ///< see ForceClient::Config::key; a key for observers is enough
    Seed seed{};                     ///< 32 random bytes from the operating system
    Duration patience = std::chrono::seconds(2);
    Duration retry_min = std::chrono::milliseconds(100);
    Duration retry_max = std::chrono::seconds(2);
    Duration describe_every = std::chrono::seconds(1);
    int max_datagrams = 256;  ///< maximum number of datagrams per turn: a quarter of a second of states at 1 kHz
  };
  /// States per second and device for /metrics while no page is open. Otherwise all states are requested.
  static constexpr std::uint32_t kIdleStateHz = 20;

  /// The `link` and the `board` must outlive this object. The first Hello is sent in the first turn.
  Observer(Link& link, const Address& server, const Config& config, Board& board, LocalTime now);

  /// Performs all work due at `now` and returns the time of the next call. Call it earlier if a datagram arrives.
  LocalTime turn(LocalTime now);

  void set_watched(bool watched) noexcept { watched_ = watched; }  ///< states at the full loop rate while `watched`

  const Address& server() const noexcept { return connection_.server(); }

  void stop(LocalTime now);  ///< sends a Bye; further turns do nothing

 private:
  struct Asked {
    enum class What : std::uint8_t { kDevice, kHandle, kStateRate };
    std::uint32_t device = 0;
    What what = What::kDevice;
  };

  void greet(LocalTime now);
  void open(LocalTime now, const Welcome& welcome);
  void end(const Connection::Ended& ended);
  void take(LocalTime now, const Connection::Event& event);
  void take_event(LocalTime now, const Session::Event& event);
  void take_answer(LocalTime now, const Session::RequestAnswered& answered);
  void ask(LocalTime now);

  Config config_;
  Board& board_;
  Connection connection_;
  std::map<std::uint32_t, std::string> names_;  ///< known device names, by index
  bool claims_ = false;                         ///< the devices are claimed by name in this attempt or session
  bool counted_ = false;                        ///< the number of devices is known
  std::map<std::uint32_t, Asked> asked_;        ///< pending requests, by id
  std::set<std::uint32_t> handles_asked_;       ///< devices whose HandleDescription was requested in this session
  std::uint32_t next_describe_ = 0;             ///< next device to describe
  LocalTime describe_at_{};
  bool watched_ = true;
  std::map<std::uint32_t, std::uint32_t> rates_;  ///< requested states per second, by device
  bool stopped_ = false;
};

}  // namespace tendon::dash
