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

/// Subscriptions and message queue of one client of /foxglove.
///
/// * Channel messages are limited to `kMaxBytes`. Beyond that, the oldest interval of 0.1 s is dropped as a whole:
///   the messages of all channels with the same ⌊t / 0.1 s⌋. This leaves a visible gap in plots instead of an
///   interpolated line. A status message then reports the number of dropped messages.
/// * Texts are never dropped, except outdated server states. A client with `kMaxTexts` waiting texts is too slow
///   and should be closed.
///
/// Thread-safe: no. Realtime-safe: no.
class FoxgloveSession {
 public:
  static constexpr std::size_t kMaxBytes = 1'000'000;  ///< about 5 s for one device
  static constexpr std::size_t kMaxTexts = 64;         ///< not reached by a client that reads its messages
  static constexpr UnixTime kDropped = 100'000'000;

  struct Message {
    std::string bytes;
    bool binary = false;
  };

  bool subscribe(std::uint32_t subscription, std::uint32_t channel);  ///< false if either is subscribed already
  bool unsubscribe(std::uint32_t subscription);  ///< discards its waiting messages; false if it does not exist
  void forget(std::uint32_t channel);            ///< removes the subscription of a removed channel
  bool subscribes_to(std::uint32_t channel) const noexcept { return subscription_of_.contains(channel); }

  void put(std::uint32_t channel, UnixTime at, std::string_view payload);  ///< if the channel is subscribed
  void put_text(std::string text) { texts_.push_back(std::move(text)); }
  void put_server_state(std::string text) { server_state_ = std::move(text); }  ///< replaces a waiting server state

  std::optional<Message> next();  ///< next message: dropped count, texts in order, server state, then data

  bool too_slow() const noexcept { return texts_.size() > kMaxTexts; }
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
  std::size_t bytes_ = 0;      ///< in data_
  std::uint64_t dropped_ = 0;  ///< not reported yet
};

}  // namespace tendon::dash
