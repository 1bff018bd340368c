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

/// Connects a client to one server and reconnects after a failure. It sends a Hello, waits for the answer, runs the
/// session and, when that ends, waits and asks its owner for the next attempt. It has no socket, clock or thread and no
/// callbacks: the owner polls for events.
///
///     connection.begin_turn();
///     while (const auto event = connection.next(now)) handle(event);     // `now` grows with each datagram
///     connection.flush(now);
///     wait for a datagram, at most until connection.next_turn()
///
/// * An attempt fails if there is no answer within Config::patience. The first retry follows after retry_min, and the
///   wait doubles up to retry_max. The first state received in a session resets it to retry_min. Each attempt uses a
///   new random and, with a key, a new ephemeral key.
/// * The Hello may change from attempt to attempt. GreetingDue therefore only reports that the wait is over; the owner
///   then calls greet().
///
/// Thread-safe: no. Realtime-safe: no.
class Connection {
 public:
  struct Config {
    std::optional<Key> key{};                     ///< if set, only sealed sessions are accepted
    Suites suites = suites_of_this_machine();     ///< the cipher suites allowed in sealed sessions
    Seed seed{};                                  ///< source of randoms and ephemeral keys: 32 bytes from the system
    Duration patience = std::chrono::seconds(2);  ///< time that one attempt waits for an answer; > 0
    Duration retry_min = std::chrono::milliseconds(100);  ///< first wait before a retry; > 0
    Duration retry_max = std::chrono::seconds(2);         ///< longest wait before a retry; not below retry_min
    int max_datagrams = 256;  ///< maximum number of datagrams taken from the link in one turn; > 0
  };

  /// The wait is over: call greet().
  struct GreetingDue {};
  /// The server accepted this client and a session is open.
  struct Opened {
    Welcome welcome;
  };
  enum class Cause : std::uint8_t {
    kUnanswered = 1,  ///< the attempt: no answer within `patience`
    kRefused = 2,     ///< the attempt: the server refused it
    kLost = 3,        ///< the session ended
  };
  /// An attempt or a session ended. GreetingDue follows after the wait.
  struct Ended {
    Cause cause;
    Code code;
    std::string reason;  ///< the reason given by the server, if any
  };
  /// The Session::Event belongs to the session. It is never Session::Closed, which is reported as Ended.
  using Event = std::variant<GreetingDue, Opened, Ended, const Session::Event*>;

  /// `link` must outlive this object. Nothing is sent before greet().
  Connection(Link& link, const Address& server, const Config& config);

  /// Begins an attempt with `hello`, to which random and keys are added. Throws std::invalid_argument if the Hello does
  /// not fit into a datagram.
  void greet(LocalTime now, const Hello& hello);

  /// Starts a turn, in which next() may take up to Config::max_datagrams from the link.
  void begin_turn() noexcept;
  /// Returns the next event, or null when this turn has no more. The event is valid until the next call. `now` is
  /// advanced to a time by which the received datagram had certainly arrived.
  const Event* next(LocalTime& now);
  /// Returns true if the turn ended at Config::max_datagrams. The link may hold more, so the next turn is due at once.
  bool more() const noexcept { return more_; }
  /// Sends all datagrams that are due.
  void flush(LocalTime now);
  /// The latest time at which the next turn must begin.
  LocalTime next_turn() const;

  /// Sends a Bye and ends the session or the attempt. No event follows; greet() may begin another attempt.
  void close(LocalTime now, std::string reason);
  /// Ends the session without a Bye. GreetingDue follows after the wait.
  void drop(LocalTime now);

  /// Sets the address for the next attempt. Must not be called while a session is open.
  void move_to(const Address& server) { server_ = server; }
  const Address& server() const noexcept { return server_; }

  /// Null while no session is open.
  Session* session() noexcept { return session_ ? &*session_ : nullptr; }
  const Session* session() const noexcept { return session_ ? &*session_ : nullptr; }
  /// Statistics of the present session, or of the last one.
  const LinkStats& link_stats() const noexcept { return session_ ? session_->stats() : last_stats_; }
  /// Number of datagrams dropped because they did not come from the server.
  std::uint64_t strangers() const noexcept { return strangers_; }

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
  std::uint64_t strangers_ = 0;
  LocalTime give_up_{};  ///< when the present attempt fails
  LocalTime retry_{};    ///< when the next attempt begins
  Duration back_off_;    ///< wait before the retry after that one
  int left_ = 0;         ///< number of datagrams that this turn may still take
  bool more_ = false;
  bool ticked_ = true;  ///< tick() was called in this turn
  Event told_;          ///< storage for the event returned by next()
};

}  // namespace tendon
