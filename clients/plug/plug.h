// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "clients/cpp/force_client.h"

namespace tendon::plug {

/// One device of a Tendon server, for programs that know nothing of Tendon. Every bridge has one for each device: it
/// reads the newest state here, and says here what its programs ask for. It has no socket, clock or thread.
///
///     Plug plug({link, server}, {another, server}, config, now);
///     for (;;) wait for a datagram, at most until plug.turn(now);
///
/// * **Onlooker first.** It begins as an observer, so that a program that only reads shuts no engine out. The first
///   force that is asked for makes it a controller of the channel (felt two round trips later); Config::idle without
///   one makes it an observer again.
/// * **One owner.** Of several programs the first one that asks for a force owns the device. Others are told that they
///   do not, and their forces are dropped. It is free again when its owner leaves or asks for nothing for Config::idle.
/// * **Freshness.** A force is sent once, and a field answers states until its time is over. Then nothing is sent: the
///   server holds, fades and stops the old force as for any engine that falls silent (protocol/SESSION.md). An old force
///   is never sent as if it were new.
/// * **At once.** What is asked for now is sent in the next turn, in answer to the newest state.
///
/// Thread-safe: no. Realtime-safe: no.
class Plug {
 public:
  /// One of the old programs, as the bridge numbers them; 0 is nobody.
  using Program = std::uint32_t;

  struct Config {
    ForceClient::Config client{};  ///< name, device, channel, key, take_lease …; `seed` is replaced by `new_seed`
    std::function<Seed()> new_seed{};
    bool observe = false;                     ///< no force of any program is sent
    Duration idle = std::chrono::seconds(1);  ///< … without a force asked for: the owner and the channel are let go
  };

  /// How one of the two sessions reaches the server: two clients, each with a socket of its own.
  struct Way {
    Link& link;
    Address server;
  };

  enum class Answer : std::uint8_t {
    kTaken = 1,      ///< it will be sent
    kOwned = 2,      ///< another program owns the device: dropped
    kObserving = 3,  ///< Config::observe: dropped
  };

  /// The links must outlive this object. The first Hello leaves with the first turn.
  Plug(const Way& watcher, const Way& controller, Config config, LocalTime now);

  /// Does everything due at `now` and returns the latest time for the next call; call earlier when a datagram arrives
  /// or something has been asked for.
  LocalTime turn(LocalTime now);

  /// The newest state, with the buttons that were held since `turn` was called last; empty until the first comes and
  /// while there is no session.
  const std::optional<DeviceState>& state() const noexcept { return state_; }
  /// When it arrived.
  LocalTime arrived() const noexcept { return arrived_; }
  /// When it was sampled, on our clock, by the estimate of the server's clock; not later than it arrived. Before the
  /// first round trip of a session: when it arrived.
  LocalTime sampled() const noexcept { return sampled_; }
  /// The number of states that have come: when it has grown, state() is new.
  std::uint64_t states() const noexcept { return states_; }
  /// What the server has said of itself, the device and its handle; empty until it has.
  const std::optional<Welcome>& welcome() const noexcept { return welcome_; }
  const std::optional<DeviceDescription>& description() const noexcept { return description_; }
  const std::optional<HandleDescription>& handle() const noexcept { return handle_; }

  /// `program` wants the hand to feel `touch`, in the device base frame: one force, as it was computed from a state that
  /// the program has seen. It is sent once, in answer to the newest state; it waits until `until` for the channel.
  Answer push(Program program, LocalTime now, LocalTime until, const Touch& touch);
  /// `program` wants the hand to feel `physics`, a field whose force is known wherever the hand is: it answers the newest
  /// state and every state until `until`. Either replaces what the same program asked for before.
  Answer ask(Program program, LocalTime now, LocalTime until, Physics physics);
  /// `program` asks for nothing any more. Nothing happens when it is not the owner.
  void release(Program program);
  Program owner() const noexcept { return owner_; }

  /// Whether the server takes our forces.
  bool pushes() const noexcept { return controller_ && controller_->holds(); }
  std::uint64_t forces() const noexcept;                              ///< sent, in all sessions
  std::uint64_t forces_dropped() const noexcept { return dropped_; }  ///< asked for by others than the owner
  std::uint64_t forces_unusable() const noexcept;                     ///< not sent: not finite, or out of bounds
  LinkStats link() const;                                             ///< of the session that the states come by
  /// The server's newest reports, of the present sessions: on our forces (while it takes them), and, with
  /// ForceClient::Config::diagnostics and only while no force is asked for, on the device's loop.
  std::optional<LinkReport> report() const { return controller_ ? controller_->report() : std::nullopt; }
  std::optional<DeviceReport> device_report() const { return watcher_ ? watcher_->device_report() : std::nullopt; }

  /// Each change in a sentence, once: connected, lost, refused, no answer, axes unknown, controls, controls no more, a
  /// force not sent. The newest 16 that nobody has taken. Empty: nothing new.
  std::optional<std::string> next_sentence();

  /// Of the session that the states come by; kStopped after stop().
  ForceClient::Phase phase() const noexcept;
  /// Whether no session is open: not yet, or not any more.
  bool lost() const noexcept { return phase() != ForceClient::Phase::kOpen; }
  /// The server is found at other addresses, for the next attempts. To be called while `lost`.
  void move_to(const Address& watcher, const Address& controller);

  /// Says Bye. Any further turn does nothing.
  void stop(LocalTime now);

 private:
  std::unique_ptr<ForceClient> new_client(LocalTime now, bool controls);
  void take(const DeviceState& state, const ForceClient& from);
  void drain(Link& link);
  void learn_from(const ForceClient& client);
  Touch answer(const DeviceState& state);
  void end_controller(LocalTime now);
  const ForceClient& speaker() const noexcept { return watcher_ ? *watcher_ : *controller_; }
  std::string connection_in_words() const;
  std::string force_in_words() const;
  void note(std::string& said, std::string words);
  void note_changes();

  Way watcher_way_;
  Way controller_way_;
  Config config_;
  std::unique_ptr<ForceClient> watcher_;
  std::unique_ptr<ForceClient> controller_;
  LocalTime now_{};  ///< of the present turn, for the callbacks

  std::optional<DeviceState> state_;
  LocalTime arrived_{};
  LocalTime sampled_{};
  std::uint64_t states_ = 0;
  std::optional<Welcome> welcome_;
  std::optional<DeviceDescription> description_;
  std::optional<HandleDescription> handle_;

  Program owner_ = 0;
  Physics physics_;    ///< of the owner; empty: nothing to send
  bool once_ = false;  ///< it is one force
  LocalTime asked_{};
  LocalTime until_{};
  std::uint64_t dropped_ = 0;
  std::uint64_t forces_before_ = 0;  ///< of the controllers that have ended
  std::uint64_t unusable_before_ = 0;
  /// What sentences are made from: while it stays, there is nothing new to say.
  struct Shown {
    ForceClient::Phase watcher = ForceClient::Phase::kStopped;
    ForceClient::Phase controller = ForceClient::Phase::kStopped;
    bool pushes = false;
    bool operator==(const Shown&) const = default;
  };
  Shown shown_;
  std::deque<std::string> sentences_;  ///< that nobody has taken yet
  std::string said_;                   ///< the newest sentence about the connection
  std::string said_of_axes_;           ///< … about how the device lies
  std::string said_of_force_;          ///< likewise, about the channel
  std::string said_of_unusable_;       ///< likewise, about a force that was not sent
  bool stopped_ = false;
};

/// Whether an attempt or a session is over and the next attempt not begun.
constexpr bool is_between_attempts(ForceClient::Phase phase) {
  return phase == ForceClient::Phase::kUnanswered || phase == ForceClient::Phase::kRefused ||
         phase == ForceClient::Phase::kLost;
}

}  // namespace tendon::plug
