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

/// Distributes changes of the Board to the clients of /foxglove, under the topics of a recording. It has no socket:
/// it consumes and produces messages. Read-only: messages of clients never reach the server.
///
///     /haptic/step, /NAME/haptic/step   each received state of the first device and of the other devices
///     /NAME/device, /NAME/peer          reports on the loop and on the engines, once per second each
///     /tf, /NAME/scene                  the newest state for drawing, 60 times per second
///
/// A topic is advertised while its device is known. If the server stops, topics stay and a status message reports it.
/// The subscriptions are still valid after the server has been restarted.
///
/// **Time stamps.** A message has the sampling time of the state (for reports, the end of the reported interval) in
/// the server's clock, plus the offset between Unix time and that clock. The offset is derived from
/// Board::server_ahead and changes only if its error exceeds kClockSlack, so that time stamps are as regular as the
/// samples.
///
/// Thread-safe: no. Realtime-safe: no.
class FoxgloveFeed {
 public:
  struct Config {
    std::string name = "tendon-dash";  ///< shown by viewers
    Duration unix_offset{};  ///< Unix time − LocalTime, read once: later changes of the system clock have no effect
  };
  using ClientId = std::uint64_t;
  static constexpr Duration kClockSlack = std::chrono::milliseconds(1);
  /// Messages per second from one client, with bursts of a tenth. Opening a layout sends one message for each topic.
  static constexpr double kMaxOrdersHz = 2000;

  /// `board` must outlive the feed.
  FoxgloveFeed(const Board& board, Config config) : board_(board), config_(std::move(config)) {}

  ClientId join(LocalTime now);
  void leave(ClientId client);
  std::size_t clients() const noexcept { return clients_.size(); }
  bool wants_states() const;  ///< whether a client needs all states, which the Observer must then request

  /// Handles a text message. Returns false if messages are too frequent or too many texts are waiting; the client
  /// should then be closed. Invalid messages are answered with a status.
  bool receive(LocalTime now, ClientId client, std::string_view text);
  /// Takes the new states. Must be called after each turn of the Observer and before Feed::tick, which removes them.
  void take(LocalTime now);
  void tick(LocalTime now);                                       ///< sends the messages for drawing
  std::optional<FoxgloveSession::Message> next(ClientId client);  ///< next message for a client, if any

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
  std::uint64_t version_ = 0;                                            ///< board version of channels_
  std::pair<Contact, std::string> said_{};                               ///< last status of the server, for all clients
  std::optional<Duration> unix_ahead_;                                   ///< Unix time − the server's clock
  std::map<std::uint32_t, std::uint64_t> states_;                        ///< number of states already taken, by device
  std::map<std::uint32_t, PeerTime> reported_;                           ///< newest report already taken, by device
  std::map<std::pair<std::uint32_t, std::uint32_t>, PeerTime> engines_;  ///< likewise, by device and channel
};

}  // namespace tendon::dash
