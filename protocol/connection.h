// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "protocol/handshake.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/secrets/crypto.h"
#include "protocol/session.h"

namespace tendon {

/// Connects a client to one server and reconnects after failures. Uses no sockets, clocks, threads or callbacks.
///
///     connection.begin_turn();
///     while (const auto event = connection.next(now)) handle(event);     // `now` grows with each datagram
///     connection.flush(now);
///     wait for a datagram, at most until connection.next_turn()
///
/// * An attempt fails if the server does not answer within Config::patience. Retries start after retry_min, with
///   exponential backoff up to retry_max. The first state received in a session resets the backoff. Each attempt uses a
///   new random and a new ephemeral key.
/// * Before each attempt, GreetingDue asks the owner to call greet(), because the contents of the Hello may change.
/// Thread-safe: no. Realtime-safe: no.
class Connection {
 public:
  struct Config {
    std::optional<Key> key{};  ///< if set, only sealed sessions are accepted
    Suites suites = suites_of_this_machine();
    Seed seed{};                                          ///< 32 random bytes from the system
    Duration patience = std::chrono::seconds(2);          ///< timeout of an attempt; > 0
    Duration retry_min = std::chrono::milliseconds(100);  ///< > 0
    Duration retry_max = std::chrono::seconds(2);         ///< >= retry_min
    int max_datagrams = 256;                              ///< limit per turn; > 0
  };

  struct GreetingDue {};  ///< call greet() now
  struct Opened {
    Welcome welcome;
  };
  enum class Cause : std::uint8_t {
    kUnanswered = 1,  ///< an attempt timed out
    kRefused = 2,     ///< an attempt was refused
    kLost = 3,        ///< a session ended
  };
  /// An attempt or a session ended. GreetingDue follows after the backoff.
  struct Ended {
    Cause cause;
    Code code;
    std::string reason;
  };
  /// Session::Closed is reported as Ended.
  using Event = std::variant<GreetingDue, Opened, Ended, const Session::Event*>;

  Connection(Link& link, const Address& server, const Config& config);

  /// Begins an attempt. Adds random and keys to `hello`. Throws std::invalid_argument if the Hello is too large.
  void greet(LocalTime now, const Hello& hello);

  void begin_turn() noexcept;
  /// Returns the next event of this turn, or null; valid until the next call. Advances `now` to after its arrival.
  const Event* next(LocalTime& now);
  /// Returns true if this turn reached Config::max_datagrams, so that the next turn is due at once.
  bool more() const noexcept { return more_; }
  void flush(LocalTime now);
  LocalTime next_turn() const;

  /// Sends a Bye and closes the session or the attempt without an event. The owner may call greet() again.
  void close(LocalTime now, std::string reason);
  void drop(LocalTime now);  ///< without a Bye; GreetingDue follows after the backoff

  /// Changes the address for the next attempt. Must not be called during a session.
  void move_to(const Address& server) { server_ = server; }
  const Address& server() const noexcept { return server_; }

  Session* session() noexcept { return session_ ? &*session_ : nullptr; }
  const Session* session() const noexcept { return session_ ? &*session_ : nullptr; }
  const LinkStats& link_stats() const noexcept { return session_ ? session_->stats() : last_stats_; }
  std::uint64_t foreign() const noexcept { return foreign_; }  ///< datagrams from other addresses, which were dropped

 private:
  const Event* next_of_session(LocalTime now);
  const Event* receive(LocalTime& now);
  const Event* tick(LocalTime now);
  const Event* settle(LocalTime now);
  const Event* end(LocalTime now, Cause cause, Code code, std::string reason);
  void forget_session();

  Link& link_;
  Address server_;
  Config config_;
  Ratchet secrets_;
  std::optional<ClientHandshake> handshake_;
  std::optional<Session> session_;
  LinkStats last_stats_;
  std::uint64_t foreign_ = 0;
  LocalTime give_up_{};
  LocalTime retry_{};
  Duration back_off_;
  int left_ = 0;  ///< datagrams left in this turn
  bool more_ = false;
  bool ticked_ = true;
  Event told_;
};

}  // namespace tendon
