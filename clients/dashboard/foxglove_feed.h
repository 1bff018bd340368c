// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/dashboard/board.h"
#include "clients/dashboard/foxglove_session.h"
#include "clients/dashboard/rate_limit.h"

namespace tendon::dash {

/// Tells the clients of /foxglove the news of the Board, under the topics that a recording has. It has no socket:
/// messages of a client go in, messages for it come out. It is read-only; nothing that a client says reaches the server.
///
///     /haptic/step, /NAME/haptic/step   every state that arrived, of the first device and of each other one
///     /NAME/device, /NAME/peer          the reports on its loop and on its engines, once a second each
///     /tf, /NAME/scene                  the newest state, at each tick (60 in a second), to be drawn
///
/// A topic is advertised when its device is known, and withdrawn when the device is gone. When the server dies nothing
/// is withdrawn: a status says what happened, and when the server is back, the same subscriptions give messages again.
///
/// **Times.** A message's time is that of the state's sample (of a report: of the end of its span) by the server's clock,
/// plus how far this machine's Unix time is ahead of that clock. The difference is the one of Board::server_ahead. It is
/// kept while it is wrong by no more than kClockSlack, so the times of a 1 kHz loop are as regular as its samples are.
///
/// Thread-safe: no. Realtime-safe: no.
class FoxgloveFeed {
 public:
  struct Config {
    std::string name = "tendon-dash";  ///< as viewers show it
    /// Unix time − LocalTime. It is read once: this program's Unix time does not follow when the system's is set.
    Duration unix_offset{};
  };
  using ClientId = std::uint64_t;
  static constexpr Duration kClockSlack = std::chrono::milliseconds(1);
  /// Messages that a client may send in a second, and a tenth of them at once: a viewer that opens a layout subscribes
  /// to each topic by a message of its own.
  static constexpr double kMaxOrdersHz = 2000;

  /// `board` must outlive the feed.
  FoxgloveFeed(const Board& board, Config config) : board_(board), config_(std::move(config)) {}

  ClientId join(LocalTime now);
  void leave(ClientId client);
  std::size_t clients() const noexcept { return clients_.size(); }
  /// Somebody subscribes to something that is made of states, so that the Observer should ask for all of them.
  bool wants_states() const;

  /// Takes a text message of a client. False when it came too fast, or more waits for this client than can be: it should
  /// then be closed. A status tells the client which message was not understood.
  bool hear(LocalTime now, ClientId client, std::string_view text);
  /// Takes what is new on the board. Call it after each turn of the Observer, before Feed::tick takes the states away.
  void take(LocalTime now);
  /// Gives out what is drawn.
  void tick(LocalTime now);
  /// The next message for a client; empty when none waits.
  std::optional<FoxgloveSession::Message> next(ClientId client);

 private:
  struct Client {
    FoxgloveSession session;
    RateLimit orders;
  };
  struct Channel {
    FoxgloveChannel about;
    std::uint32_t device = 0;
  };

  void take_channels();
  void take_states(LocalTime now, std::uint32_t device, const Board::Device& news);
  void take_reports(LocalTime now, std::uint32_t device, const Board::Device& news);
  std::vector<Channel> wanted_channels() const;
  const Channel* subscribed(FoxgloveKind kind, std::uint32_t device) const;
  void put(const Channel& channel, UnixTime at, const std::string& payload);
  UnixTime unix_time(LocalTime now, PeerTime at);
  std::string server_state() const;

  const Board& board_;
  Config config_;
  ClientId last_ = 0;
  std::map<ClientId, Client> clients_;
  std::vector<Channel> channels_;
  std::uint32_t last_channel_ = 0;
  std::uint64_t version_ = 0;                      ///< of the board that the channels were made from
  std::pair<Contact, std::string> said_{};         ///< of the server, to all clients
  std::optional<Duration> unix_ahead_;             ///< Unix time − the server's clock
  std::map<std::uint32_t, std::uint64_t> states_;  ///< of each device, as the board counts them, that were taken
  std::map<std::uint32_t, PeerTime> reported_;     ///< the newest report on each device that was taken
  std::map<std::pair<std::uint32_t, std::uint32_t>, PeerTime> engines_;  ///< … on each device's channel
};

}  // namespace tendon::dash
