// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "clients/dashboard/foxglove_text.h"

namespace tendon::dash {

/// One client of /foxglove: what it has subscribed to, and what waits for it while it does not read.
///
/// * Messages of channels may fill `kMaxBytes`. Beyond that the oldest tenth of a second is dropped, whole: all messages
///   whose times have the same ⌊t / 0.1 s⌋, of all channels. A plot then has a gap that is seen, and not a line that
///   lies. The next thing that the client reads is a status with the number of messages that were dropped.
/// * Texts are never dropped; of the server's state only the newest is kept. A client for which `kMaxTexts` wait is
///   `hopeless`, and should be closed.
///
/// Thread-safe: no. Realtime-safe: no.
class FoxgloveSession {
 public:
  /// About 5 s of one device's steps.
  static constexpr std::size_t kMaxBytes = 1'000'000;
  /// Far more than a client causes that reads what it is told.
  static constexpr std::size_t kMaxTexts = 64;
  static constexpr UnixTime kDropped = 100'000'000;

  struct Message {
    std::string bytes;
    bool binary = false;
  };

  /// False: it has that subscription, or subscribes to that channel already.
  bool subscribe(std::uint32_t subscription, std::uint32_t channel);
  /// What waits of it is forgotten. False: there is no such subscription.
  bool unsubscribe(std::uint32_t subscription);
  /// Ends the subscription to a channel that is no longer there.
  void forget(std::uint32_t channel);
  bool subscribes_to(std::uint32_t channel) const noexcept { return subscription_of_.contains(channel); }

  /// Gives out the payload if it subscribes to the channel.
  void put(std::uint32_t channel, UnixTime at, std::string_view payload);
  void put_text(std::string text) { texts_.push_back(std::move(text)); }
  /// What the server is doing; takes the place of an older one that still waits.
  void put_server_state(std::string text) { server_state_ = std::move(text); }

  /// The next message to send: first what was dropped, then texts in their order, the server's state, and data.
  std::optional<Message> next();

  bool hopeless() const noexcept { return texts_.size() > kMaxTexts; }
  std::size_t waiting_bytes() const noexcept { return bytes_; }

 private:
  struct Waiting {
    std::uint32_t subscription = 0;
    UnixTime at = 0;
    std::string bytes;
  };

  template <class Which>
  void erase_data(Which which);

  std::map<std::uint32_t, std::uint32_t> subscription_of_;  ///< by channel
  std::deque<std::string> texts_;
  std::optional<std::string> server_state_;
  std::deque<Waiting> data_;
  std::size_t bytes_ = 0;      ///< of all data
  std::uint64_t dropped_ = 0;  ///< messages, not told yet
};

}  // namespace tendon::dash
