// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cpp/force_client.h"
#include "clients/dashboard/board.h"
#include "protocol/link.h"
#include "protocol/secrets/crypto.h"

namespace tendon::dash {

/// Arms and disarms devices, and engages and disengages couplings, for the person who presses the page's buttons. It
/// has no socket, clock or thread.
///
/// Each press is a session of its own, beside the Observer's: a controller with the operator's key that claims one
/// channel of the device, holds it, sends the order and never a force, and leaves at the answer. Between two
/// presses there is no controller. The result of a press is written on the Board in words. It tells what the device
/// did, not what the server answered: the device's states have the reason "disarmed" and no force, or its report says
/// "armed"; or its end of the coupling says that it is engaged, or that it is not.
///
/// * **An engine is never disturbed.** While another client holds the channel nothing is sent at all (`objection`), and
///   a lease is never taken from anybody, not even by a key that the scene lets take over. It is best to give the
///   operator a channel of his own. The key, too, should be his own: tendond gives a key's place to the newest client
///   that comes with it, and the Board's list of holders is up to a second old.
/// * **Disarm has priority.** It ends any other order that is under way; nothing ends a disarming. Disengaging ends an
///   arming or engaging.
/// * **Engaging** is for the leader's end, while both ends are coupled and wait for it.
///
/// Thread-safe: no. Realtime-safe: no.
class Operator {
 public:
  struct Config {
    std::string name = "tendon-dash operator";  ///< for the server's log; at most limits::kMaxLabel bytes
    std::string channel;                        ///< the channel that each device has for the operator
    Key key;                                    ///< a controller's
    Seed seed{};                                ///< 32 bytes from the system at each start
    /// Time for the session and the server's answer: enough for a round trip of 1 s at 50 % loss.
    Duration patience = std::chrono::seconds(5);
    /// Time for the device, from the answer on: the safety layer may take a second to grant the order, and the next
    /// report on it may take another second.
    Duration granted_within = std::chrono::seconds(4);
  };

  /// `link` must not be the Observer's, because to the server one address is one guest. `link` and `board` must outlive
  /// this object.
  Operator(Link& link, const Address& server, const Config& config, Board& board);

  /// Why no order can be given to a device now, in a sentence; empty when one can.
  std::string objection(std::uint32_t device) const;

  /// Takes the press of a button. Returns why nothing is done; empty when the order has begun.
  std::string press(LocalTime now, std::uint32_t device, Order order);

  /// Does everything due at `now`; call it about sixty times a second.
  void turn(LocalTime now);

  /// Sets the address of the server for the next press.
  void move_to(const Address& server) { server_ = server; }

  /// Leaves.
  void stop(LocalTime now);

 private:
  void ask(LocalTime now);
  bool send();
  void look(LocalTime now);
  void look_at_safety(LocalTime now, const Board::Device* device);
  void look_at_coupling(LocalTime now, const Board::Device* device);
  void tell(Press::State state, std::string words);
  void finish(LocalTime now, bool done, std::string words);
  std::string held_by(const ChannelDescription& channel) const;
  std::string coupling_objection(const Board::Device& device, Order order) const;

  Link& link_;
  Address server_;
  Config config_;
  Board& board_;
  Ratchet secrets_;
  std::uint32_t device_ = 0;
  Order order_ = Order::kArm;
  bool under_way_ = false;
  std::optional<ForceClient> client_;  ///< until the server has answered
  bool asked_ = false;
  LocalTime give_up_{};
  PeerTime answered_{};  ///< the device's newest sample when the server answered
};

}  // namespace tendon::dash
