// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cpp/server_name.h"
#include "clients/cpp/udp_transport.h"
#include "clients/plug/plug.h"
#include "server/machine/output.h"

namespace tendon::plug {

/// What the command line says for every bridge.
struct DeskConfig {
  ServerName server = "127.0.0.1:47100";
  ForceClient::Config client{};        ///< `device` and `seed` are set for each plug
  std::vector<std::string> devices{};  ///< their names; none: the server's first device, which is called "device"
  bool observe = false;
  bool json = false;  ///< a line a second on stdout
};

/// All devices of one bridge with their sockets: what a bridge's loop turns and sleeps on.
///
///     Desk desk(config, read_clock());
///     for (LocalTime now = read_clock(); !stop; now = read_clock()) {
///       const LocalTime next = desk.turn(now);
///       … serve the programs: desk.plug(0).state(), desk.plug(0).ask(…); when something was asked: desk.turn(now)
///       desk.wait(sockets_of_the_programs, now, next);
///     }
///
/// It looks the server's name up again between two attempts, and says each change of a plug in one sentence on stderr:
/// "tendon-plug: right: connected to …". With `json`, once a second, a line for each device:
///
///     {"device":"right","states":1000,"forces":998,"dropped":0,"unusable":0,"owner":1,"pushes":true,
///      "round_trip_ms":0.4, …}                     counts from the start; then the bridge's own
///
/// Thread-safe: no. Realtime-safe: no.
class Desk {
 public:
  /// A number of the bridge's own for the JSON lines.
  using Count = std::pair<std::string_view, std::uint64_t>;

  /// Throws std::runtime_error as UdpTransport does when the server's name is not known.
  Desk(DeskConfig config, LocalTime now);

  std::size_t size() const noexcept { return places_.size(); }
  Plug& plug(std::size_t i) { return places_[i].plug; }
  const std::string& name(std::size_t i) const { return places_[i].name; }

  /// Turns every plug; the latest time for the next turn. `counts` are for the JSON lines.
  LocalTime turn(LocalTime now, std::span<const Count> counts = {});

  /// One sentence on stderr, "tendon-plug: …".
  void say(const std::string& sentence) const;

  /// Sleeps until a datagram of the server or one of `others` is ready, or until `until`; at most 100 ms, so that a
  /// signal is noticed. `others` have their `revents` afterwards.
  void wait(std::span<pollfd> others, LocalTime now, LocalTime until);
  /// The sockets towards the server, for a loop that sleeps otherwise. They are others after a look-up: ask each time.
  std::vector<int> descriptors() const;

  /// Says Bye for each. Returns the exit code: 1 if a device has never sent a state, which is then said.
  int stop(LocalTime now);

 private:
  struct Place {
    Place(const DeskConfig& config, const std::string& device, LocalTime now);
    std::string name;
    UdpTransport watcher;
    UdpTransport controller;
    Plug plug;
    ForceClient::Phase phase = ForceClient::Phase::kGreeting;
  };

  void look_up_again(Place& place);
  void write_line(std::span<const Count> counts);

  UnblockedOutput output_;
  DeskConfig config_;
  std::deque<Place> places_;
  std::vector<pollfd> polled_;
  LocalTime next_line_{};
};

}  // namespace tendon::plug
