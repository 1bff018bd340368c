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

/// Observers that come, see one state, say Bye and come again from another port: `in_all` times, evenly over
/// `duration`, from `threads` threads. A server that leaks anything per session leaks it that often.
class Reconnecting {
 public:
  Reconnecting(const Address& server, std::uint64_t in_all, Duration duration, int threads);
  ~Reconnecting() { stop(); }
  Reconnecting(const Reconnecting&) = delete;
  Reconnecting& operator=(const Reconnecting&) = delete;

  void stop();
  std::uint64_t sessions() const noexcept { return sessions_; }  ///< that showed a state
  std::uint64_t vain() const noexcept { return vain_; }          ///< attempts in which none came within kPatience

 private:
  static constexpr Duration kPatience = std::chrono::seconds(10);
  bool visit(std::uint64_t number, const Address& server) const;

  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> sessions_{0};
  std::atomic<std::uint64_t> vain_{0};
  std::vector<std::thread> threads_;
};

/// An observer that stays, and holds each state against what a server promises: numbers that are finite, a force within
/// the limiter's bound, an account that falls below −1 nJ only after an overrun.
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
  /// In words, the first one; empty when there is none.
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
