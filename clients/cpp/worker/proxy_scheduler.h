// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "clients/cpp/force_client.h"

namespace tendon::worker {

/// Scheduling policy of a ProxyEngine: when to send a state to the worker, which answers to use, and when to replace
/// the worker. A pure state machine without sockets, processes or clocks.
///
/// * **Newest wins.** The worker has one state at a time, then gets the newest one; states are not queued.
/// * **Late answers are dropped.** Answers that exceed the deadline are counted and dropped. The worker stays.
/// * **Timing statistics use answers with a force.** Answers in free space are fast and frequent, so they are not
///   representative. The first answer with a force may be slow because a solver has no warm start yet.
/// * **Slow answers stay valid longer.** If three times the median is above kMinDeadline, it is the validity of each
///   answer; otherwise the client would derive the validity from the fast answers before contact.
/// * **A dead worker is replaced.** A worker is given up after `dead` without an answer, or when its stream ends. The
///   next one starts after `retry_min`. The wait doubles with each failure up to `retry_max`, and is reset once a
///   worker has answered for longer than the wait.
/// * **Fallback.** While no worker is available or the answer is late, `fallback` (if set) answers each new state. Its
///   error is increased by its last difference from an answer of the worker to the same state.
///
/// Thread-safe: no. Realtime-safe: no.
class ProxyScheduler {
 public:
  struct Config {
    Duration deadline{};  ///< 0: three times the median of the newest answers with a force, at least kMinDeadline
    Duration dead{};      ///< 0: ten times that median, at least kMinDead; kDeadAtFirst before the first force
    Duration start = std::chrono::minutes(2);  ///< timeout from the launch to the opening of the stream; > 0
    Duration retry_min = std::chrono::milliseconds(500);
    Duration retry_max = std::chrono::seconds(30);
    Physics fallback{};
  };
  static constexpr Duration kMinDeadline = std::chrono::milliseconds(50);
  static constexpr Duration kMinDead = std::chrono::milliseconds(500);
  static constexpr Duration kDeadAtFirst = std::chrono::seconds(10);

  enum class Worker : std::uint8_t {
    kAbsent = 1,
    kStarting = 2,
    kIdle = 3,
    kBusy = 4,
  };

  struct Stats {
    Worker worker = Worker::kAbsent;
    std::uint64_t launches = 0;
    std::uint64_t asked = 0;  ///< states sent to a worker
    std::uint64_t answers = 0;
    std::uint64_t unknown = 0;  ///< subset of `answers` without a force
    std::uint64_t late = 0;
    std::uint64_t refused = 0;
    std::string_view why_refused{};
    std::uint64_t fallback = 0;
    double fallback_difference = 0;  ///< N, last difference from an answer of the worker
    std::uint64_t given_up = 0;
    std::string why_given_up{};
    Duration median{};  ///< of the newest answers with a force, including late ones
  };

  /// Throws std::invalid_argument "FIELD = VALUE: expected …". The first launch is due immediately.
  ProxyScheduler(const Config& config, LocalTime now);

  // Inputs:

  void see(const Seen& seen);
  void opened();  ///< the stream to the worker is open
  /// The worker answered the last state, or its answer is invalid for the reason `why` (stream.h).
  void answered(LocalTime now, const Touch& touch);
  void refused(std::string_view why);
  void ended(LocalTime now, const std::string& why);  ///< must be called if the stream or the program has ended

  // Outputs; call turn() until it returns empty:

  struct Launch {};
  struct GiveUp {  ///< kill the worker and all its descendants
    std::string why;
  };
  struct Ask {  ///< send this state to the worker
    std::uint64_t sequence = 0;
    DeviceState hand{};
  };
  using Order = std::variant<Launch, GiveUp, Ask, Reply>;
  std::optional<Order> turn(LocalTime now);

  LocalTime next_turn() const;  ///< time of the next turn; LocalTime::max() while only waiting for an input

  Stats stats() const;

 private:
  static constexpr std::size_t kTimes = 63;

  Duration deadline() const;
  Duration dead() const;
  Duration median() const;
  bool overdue(LocalTime now) const { return worker_ == Worker::kBusy && now - asked_ > deadline(); }
  std::optional<Order> fall_back(LocalTime now);
  void give_up(LocalTime now, const std::string& why);

  Config config_;
  Worker worker_ = Worker::kAbsent;
  LocalTime due_;                          ///< kAbsent: time of the next launch; kStarting: end of the timeout
  Duration wait_;                          ///< before the launch after the next failure
  std::optional<LocalTime> first_answer_;  ///< of the current worker
  LocalTime asked_{};
  std::uint64_t sequence_ = 0;
  Seen question_{};
  std::optional<Seen> newest_;    ///< not yet sent to the worker
  bool newest_answered_ = false;  ///< newest_ was answered by the fallback
  std::optional<Reply> answer_;
  std::optional<std::string> to_give_up_;
  std::array<Duration, kTimes> times_{};
  std::size_t count_ = 0;
  Stats stats_;
};

}  // namespace tendon::worker
