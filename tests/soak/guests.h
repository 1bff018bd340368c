// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"

namespace tendon::soak {

/// Observers that connect, receive one state, send a Bye and reconnect from another port. There are `in_all`
/// reconnections, evenly distributed over `duration` and over `threads` threads. If a session leaks anything, this
/// makes it visible.
class Reconnecting {
 public:
  Reconnecting(const Address& server, std::uint64_t in_all, Duration duration, int threads);
  ~Reconnecting() { stop(); }
  Reconnecting(const Reconnecting&) = delete;
  Reconnecting& operator=(const Reconnecting&) = delete;

  void stop();
  std::uint64_t sessions() const noexcept { return sessions_; }  ///< sessions that received a state
  std::uint64_t vain() const noexcept { return vain_; }          ///< attempts without a state within kPatience

 private:
  static constexpr Duration kPatience = std::chrono::seconds(10);
  bool visit(std::uint64_t number, const Address& server) const;

  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> sessions_{0};
  std::atomic<std::uint64_t> vain_{0};
  std::vector<std::thread> threads_;
};

/// A permanent observer that checks each state. All values must be finite, the force must be within the bound of the
/// limiter, and the energy account may only be below −1 nJ after an overrun.
class Watching {
 public:
  explicit Watching(const Address& server);
  ~Watching() { stop(); }
  Watching(const Watching&) = delete;
  Watching& operator=(const Watching&) = delete;

  void stop();
  std::uint64_t states() const noexcept { return states_; }
  std::uint64_t sessions() const noexcept { return sessions_; }
  Duration longest_silence() const noexcept { return Duration(longest_silence_); }
  std::optional<std::string> broken() const;

 private:
  void watch(const Address& server);

  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> states_{0};
  std::atomic<std::uint64_t> sessions_{0};
  std::atomic<Duration::rep> longest_silence_{0};
  mutable std::mutex mutex_;
  std::optional<std::string> broken_;
  std::thread thread_;
};

}  // namespace tendon::soak
