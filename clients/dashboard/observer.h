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

/// Watches every device of a Tendon server, or of one bank of a large server, in one session and writes all news on a
/// Board. It is an observer and never
/// sends a force. It has no socket, clock or thread.
///
///     Observer observer(link, server, config, board, now);
///     for (;;) wait for a datagram, at most until observer.turn(now);
///
/// A guest sees only the devices that it has claimed by name, and learns their names by asking (Describe) for device 0,
/// 1, 2 … until there is none. So a server with several devices is greeted twice: the first session asks, the second
/// one claims all of them.
///
/// * **Reconnection.** It tries for ever (see Connection), so it finds a server that comes back.
/// * **Handles.** It asks for each device's HandleDescription once a session, where the server knows kFeatureHandle.
/// * **Holders.** It asks for each device's description again every `describe_every`, because engines come and go.
///
/// Thread-safe: no. Realtime-safe: no.
class Observer {
 public:
  struct Config {
    std::string name = "tendon-dash";  ///< for the server's log; at most limits::kMaxName bytes
    /// One of those to watch. A session has 16 devices, those of one bank; empty: the first bank. A server that has no
    /// such device refuses us, and says which it has.
    std::string device{};
    /// Additional addresses of the server. If there is no answer, the next address is tried.
    std::vector<Address> further{};
    std::optional<Key> key{};  ///< as ForceClient::Config::key; an observer's will do
    Seed seed{};               ///< 32 bytes from the system at each start
    Duration patience = std::chrono::seconds(2);
    Duration retry_min = std::chrono::milliseconds(100);
    Duration retry_max = std::chrono::seconds(2);
    Duration describe_every = std::chrono::seconds(1);
    /// Datagrams taken from the link in one turn: a quarter of a second of states at 1 kHz.
    int max_datagrams = 256;
  };
  /// States per second and device while nobody looks: enough for /metrics. While somebody looks it gets all states.
  static constexpr std::uint32_t kIdleStateHz = 20;

  /// `link` and `board` must outlive this object. The first Hello leaves with the first turn.
  Observer(Link& link, const Address& server, const Config& config, Board& board, LocalTime now);

  /// Does everything due at `now` and returns the latest time for the next call; call earlier when a datagram arrives.
  LocalTime turn(LocalTime now);

  /// Says whether somebody looks at the states, which then come at the loop's own rate.
  void set_watched(bool watched) noexcept { watched_ = watched; }

  /// The address that is currently used.
  const Address& server() const noexcept { return connection_.server(); }

  /// Says Bye. Any further turn does nothing.
  void stop(LocalTime now);

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
  std::map<std::uint32_t, std::string> names_;  ///< of the devices, as far as they are known
  bool claims_ = false;                         ///< this attempt or session has claimed the devices by name
  bool counted_ = false;                        ///< the number of devices is known
  std::map<std::uint32_t, Asked> asked_;        ///< open requests, by id
  std::set<std::uint32_t> handles_asked_;       ///< devices whose HandleDescription was asked for in this session
  std::uint32_t next_describe_ = 0;             ///< the device to ask about next
  LocalTime describe_at_{};
  bool watched_ = true;
  std::map<std::uint32_t, std::uint32_t> rates_;  ///< states per second that each device was asked for
  bool stopped_ = false;
};

}  // namespace tendon::dash
