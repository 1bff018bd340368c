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

/// Arms and disarms devices, and engages and disengages couplings, for the page. It uses no sockets, clocks or threads.
///
/// Each button press opens a session separate from that of the Observer: a controller with the operator's key that
/// claims and holds one channel of the device, sends the order but no force, and leaves after the answer. The result on
/// the Board depends on the reaction of the device, not only on the answer of the server: the reason "disarmed" without
/// force, the report "armed", or the coupling state.
///
/// * **Engines are not disturbed.** While another client holds the channel, nothing is sent (`objection`), and leases
///   are never taken over, even if the key has the permission. The operator should have a separate channel and key:
///   tendond replaces a client by a newer one with the same key, and the Board's list of holders may be one second old.
/// * **Disarm has priority.** It cancels other orders and cannot be canceled. Disengaging cancels arming and engaging.
/// * **Engaging** requires the leader's end, and both ends must be coupled and waiting.
///
/// Thread-safe: no. Realtime-safe: no.
class Operator {
 public:
  struct Config {
    std::string name = "tendon-dash operator";    ///< for the log of the server; at most limits::kMaxLabel bytes
    std::string channel;                          ///< channel reserved for the operator at each device
    Key key;                                      ///< of a controller
    Seed seed{};                                  ///< 32 random bytes from the operating system
    Duration patience = std::chrono::seconds(5);  ///< for the session and the answer (round trip of 1 s, 50 % loss)
    Duration granted_within = std::chrono::seconds(4);  ///< reaction after the answer: safety layer ≤ 1 s, report ≤ 1 s
  };

  /// `link` must not be the Observer's, because the server identifies clients by address. Both must outlive this.
  Operator(Link& link, const Address& server, const Config& config, Board& board);

  std::string objection(std::uint32_t device) const;  ///< why the device cannot be controlled; empty if it can

  /// Starts an order. Returns the reason if it cannot be started, otherwise an empty string.
  std::string press(LocalTime now, std::uint32_t device, Order order);

  void turn(LocalTime now);  ///< performs the work due at `now`; must be called about 60 times per second

  void move_to(const Address& server) { server_ = server; }

  void stop(LocalTime now);  ///< ends the session

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
  PeerTime answered_{};  ///< newest sampling time of the device at the server's answer
};

}  // namespace tendon::dash
