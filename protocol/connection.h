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

/// A guest's way to one server, over all its attempts and sessions: it says Hello, waits for the answer, runs the
/// session, and when that is over waits and asks for the next attempt. It has no socket, clock or thread, and it calls
/// nobody: its owner pulls events.
///
///     connection.begin_turn();
///     while (const auto event = connection.next(now)) act on it;         // `now` grows with each datagram
///     connection.flush(now);
///     wait for a datagram, at most until connection.next_turn()
///
/// * **Attempts.** An attempt ends after Config::patience without an answer. The next one begins after a wait of
///   retry_min, then twice as long each time, at most retry_max. The first state of a session sets the wait back to
///   retry_min. Each attempt has a new random and, with a key, a new ephemeral key.
/// * **The owner greets.** What a Hello says may change from attempt to attempt. So GreetingDue only says that the wait
///   is over; the owner then calls greet().
///
/// Thread-safe: no. Realtime-safe: no.
class Connection {
 public:
  struct Config {
    std::optional<Key> key{};                             ///< when set, sessions are sealed, and only so
    Suites suites = suites_of_this_machine();             ///< … by one of these
    Seed seed{};                                          ///< of randoms and ephemeral keys: 32 bytes from the system
    Duration patience = std::chrono::seconds(2);          ///< of one attempt; > 0
    Duration retry_min = std::chrono::milliseconds(100);  ///< first wait before the next attempt; > 0
    Duration retry_max = std::chrono::seconds(2);         ///< longest wait; not below retry_min
    int max_datagrams = 256;                              ///< taken from the link in one turn; > 0
  };

  /// The wait is over: greet() now.
  struct GreetingDue {};
  /// The server has let us in, and a session is open.
  struct Opened {
    Welcome welcome;
  };
  enum class Cause : std::uint8_t {
    kUnanswered = 1,  ///< an attempt: nobody answered within the patience
    kRefused = 2,     ///< an attempt: the server said no
    kLost = 3,        ///< a session
  };
  /// An attempt or a session is over. GreetingDue comes after the wait.
  struct Ended {
    Cause cause;
    Code code;
    std::string reason;  ///< the server's words where it had any
  };
  /// A Session::Event in here is never Session::Closed: that is told as Ended. It is the session's own.
  using Event = std::variant<GreetingDue, Opened, Ended, const Session::Event*>;

  /// `link` must outlive this object. Nothing is sent before greet().
  Connection(Link& link, const Address& server, const Config& config);

  /// Begins an attempt. `hello` says who comes; random and keys are added here. Throws std::invalid_argument when the
  /// Hello is longer than a datagram holds.
  void greet(LocalTime now, const Hello& hello);

  /// Opens a turn: next() may take Config::max_datagrams from the link again.
  void begin_turn() noexcept;
  /// The next thing to act on, null when this turn has no more. It stays until the next call. `now` grows to when a
  /// datagram was certainly here.
  const Event* next(LocalTime& now);
  /// The link may hold more than one turn may take: the next turn is due at once.
  bool more() const noexcept { return more_; }
  /// Sends all that is due.
  void flush(LocalTime now);
  /// When the next turn is due at the latest.
  LocalTime next_turn() const;

  /// Says Bye and ends the session or the attempt, with nothing to follow: greet() may begin another one.
  void close(LocalTime now, std::string reason);
  /// Ends the session without a word; GreetingDue comes after the wait.
  void drop(LocalTime now);

  /// The server is found at another address from the next attempt on. Not to be called while a session is open.
  void move_to(const Address& server) { server_ = server; }
  const Address& server() const noexcept { return server_; }

  /// The open session; null while there is none.
  Session* session() noexcept { return session_ ? &*session_ : nullptr; }
  const Session* session() const noexcept { return session_ ? &*session_ : nullptr; }
  /// Of the present session, or of the last one.
  const LinkStats& link_stats() const noexcept { return session_ ? session_->stats() : last_stats_; }
  /// Datagrams that were not from the server: dropped.
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
  LocalTime give_up_{};  ///< end of the present attempt's patience
  LocalTime retry_{};    ///< when the next attempt begins
  Duration back_off_;    ///< wait before the attempt after that
  int left_ = 0;         ///< datagrams that this turn may still take
  bool more_ = false;
  bool ticked_ = true;  ///< in this turn
  Event told_;          ///< the newest one
};

}  // namespace tendon
