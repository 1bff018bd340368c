// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "clients/cpp/force_client.h"

namespace tendon::bridge {

/// One device of a Tendon server, for programs that do not know Tendon. The bridge reads the newest state from it and
/// passes it the forces of its programs. It has no socket, clock or thread.
///
///     BridgedDevice bridged({link, server}, {another, server}, config, now);
///     for (;;) wait for a datagram, at most until bridged.turn(now);
///
/// * **Observer first.** It starts as an observer, so that a program that only reads does not exclude an engine. The
///   first requested force makes it a controller of the channel, which takes two round trips. After Config::idle
///   without a force it becomes an observer again.
/// * **One owner.** The first program that requests a force owns the device, until it leaves or makes no request for
///   Config::idle. The forces of other programs are dropped, and the programs are informed.
/// * **Freshness.** A single force is sent once; a field answers states until it expires. If there is no force, the
///   server holds, fades and stops the last force (protocol/SESSION.md). An old force is never sent as a new one.
/// * **Latency.** A requested force is sent in the next turn as an answer to the newest state.
///
/// Thread-safe: no. Realtime-safe: no.
class BridgedDevice {
 public:
  using Program = std::uint32_t;  ///< number of a program, assigned by the bridge; 0: none

  struct Config {
    ForceClient::Config client{};  ///< `seed` is replaced by `new_seed`
    std::function<Seed()> new_seed{};
    bool observe = false;                     ///< drop the forces of all programs
    Duration idle = std::chrono::seconds(1);  ///< the owner and the channel are released after this time
    /// Keeps the session of the observer while a force is requested, because it receives the device_report(). During
    /// this time, each state is received twice.
    bool always_observe = false;
  };

  struct Route {  // each of the two sessions has its own socket
    Link& link;
    Address server;
  };

  enum class Answer : std::uint8_t {
    kTaken = 1,      ///< will be sent
    kOwned = 2,      ///< dropped: there is another owner
    kObserving = 3,  ///< dropped: Config::observe is set
  };

  /// The links must outlive this object. The first Hello is sent in the first turn.
  BridgedDevice(const Route& watcher, const Route& controller, Config config, LocalTime now);

  /// Performs the work due at `now`. Returns the time of the next call; call earlier after a datagram or a request.
  LocalTime turn(LocalTime now);

  /// The newest state, with buttons pressed since the last turn. Empty if there is no state or no session.
  const std::optional<DeviceState>& state() const noexcept { return state_; }
  LocalTime arrived() const noexcept { return arrived_; }
  /// Sampling time of the state in the local clock, computed with the estimate of the server's clock, at most
  /// arrived(). Equals arrived() before the first round trip of a session.
  LocalTime sampled() const noexcept { return sampled_; }
  std::uint64_t states() const noexcept { return states_; }  ///< received; if it has increased, state() is new
  /// The descriptions from the server. Empty until they arrive.
  const std::optional<Welcome>& welcome() const noexcept { return welcome_; }
  const std::optional<DeviceDescription>& description() const noexcept { return description_; }
  const std::optional<HandleDescription>& handle() const noexcept { return handle_; }

  /// Requests one force on the hand, in the device base frame. It answers the newest state and is sent once. If the
  /// channel is not available yet, the force waits until `until`.
  Answer push(Program program, LocalTime now, LocalTime until, const Touch& touch);
  /// Requests a force field that answers each state until `until`. push() and ask() replace the program's last request.
  Answer ask(Program program, LocalTime now, LocalTime until, Physics physics);
  void release(Program program);  ///< does nothing if the program is not the owner
  /// Asks the server to disarm the device. This does not require the channel, but a session as a controller, which is
  /// opened if necessary. If the session is lost, the request is repeated in the next one for up to 5 s. The result is
  /// a message. Returns false if Config::observe is set, and after stop().
  bool disarm(LocalTime now);
  Program owner() const noexcept { return owner_; }

  bool pushes() const noexcept { return controller_ && controller_->holds(); }  ///< the server accepts forces from here
  std::uint64_t forces() const noexcept;                                        ///< in all sessions
  std::uint64_t forces_dropped() const noexcept { return dropped_; }  ///< requested by programs other than the owner
  std::uint64_t forces_unusable() const noexcept;
  LinkStats link() const;  ///< statistics of the session that receives the states
  /// Newest reports of the server in the current sessions: on the forces, while a channel is held; and on the loop of
  /// the device, with ForceClient::Config::diagnostics. While a force is requested, the latter requires
  /// Config::always_observe.
  std::optional<LinkReport> report() const { return controller_ ? controller_->report() : std::nullopt; }
  std::optional<DeviceReport> device_report() const { return watcher_ ? watcher_->device_report() : std::nullopt; }

  /// Returns the next message about a change: connected, lost, refused, no answer, orientation unknown, control
  /// gained or lost, force not sent. Empty: none. Only the newest 16 messages are kept.
  std::optional<std::string> next_sentence();

  ForceClient::Phase phase() const noexcept;  ///< phase of the session that receives the states; kStopped after stop()
  bool lost() const noexcept { return phase() != ForceClient::Phase::kOpen; }  ///< whether no session is open
  /// Sets the server addresses for the next attempts. Must be called while lost().
  void move_to(const Address& watcher, const Address& controller);

  void stop(LocalTime now);  ///< sends a Bye; further turns do nothing

 private:
  std::unique_ptr<ForceClient> new_client(LocalTime now, bool controls);
  void take(const DeviceState& state, const ForceClient& from);
  void drain(Link& link);
  void learn_from(const ForceClient& client);
  Touch answer(const DeviceState& state);
  void end_controller(LocalTime now);
  bool turn_disarm(LocalTime now);
  const ForceClient& speaker() const noexcept { return watcher_ ? *watcher_ : *controller_; }
  std::string connection_in_words() const;
  std::string force_in_words() const;
  void say(std::string words);
  void note(std::string& said, std::string words);
  void note_changes();

  Route watcher_route_;
  Route controller_route_;
  Config config_;
  std::unique_ptr<ForceClient> watcher_;
  std::unique_ptr<ForceClient> controller_;
  LocalTime now_{};

  std::optional<DeviceState> state_;
  LocalTime arrived_{};
  LocalTime sampled_{};
  std::uint64_t states_ = 0;
  std::optional<Welcome> welcome_;
  std::optional<DeviceDescription> description_;
  std::optional<HandleDescription> handle_;

  Program owner_ = 0;
  Physics physics_;    ///< the request of the owner; empty if there is nothing to send
  bool once_ = false;  ///< physics_ is a single force
  LocalTime asked_{};
  LocalTime until_{};
  std::optional<LocalTime> disarm_until_;        ///< there is no answer yet
  std::optional<std::uint64_t> disarm_session_;  ///< the session in which the request was sent
  std::uint64_t dropped_ = 0;
  std::uint64_t forces_before_ = 0;  ///< sent by previous controllers
  std::uint64_t unusable_before_ = 0;
  struct Shown {  // what the messages describe: no new ones while it is unchanged
    ForceClient::Phase watcher = ForceClient::Phase::kStopped;
    ForceClient::Phase controller = ForceClient::Phase::kStopped;
    bool pushes = false;
    bool operator==(const Shown&) const = default;
  };
  Shown shown_;
  std::deque<std::string> sentences_;
  std::string said_;
  std::string said_of_axes_;
  std::string said_of_force_;
  std::string said_of_unusable_;
  bool stopped_ = false;
};

constexpr bool is_between_attempts(ForceClient::Phase phase) {
  return phase == ForceClient::Phase::kUnanswered || phase == ForceClient::Phase::kRefused ||
         phase == ForceClient::Phase::kLost;
}

}  // namespace tendon::bridge
