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

/// When a front asks its worker, which answers it takes, and when it gives a worker up. Values in, values out: no
/// socket, no process, no clock.
///
/// * **Newest wins.** A worker has one state at a time. When it has answered, it gets the newest; no queue is worked off.
/// * **Late answers are not sent.** An answer that took longer than the deadline is counted. The worker stays.
/// * **The answers with a force tell what is usual.** In free space an answer takes next to nothing, and a hand is there
///   often. The first answer with a force may take long: a solver that remembers has nothing to remember yet.
/// * **A slow body's answer holds until the next one is late.** Where three times their median is above kMinDeadline, it
///   is the time for which an answer is valid: a client would take the quick answers before a touch for usual.
/// * **A dead worker is replaced.** Without an answer for `dead` it is given up, and so it is when its stream ends. The
///   next one starts `retry_min` later, twice as long after each failure, at most `retry_max`; a worker that answered
///   for longer than that wait sets it back.
/// * **Fallback.** While no worker can be asked, or the answer is late, each new state is answered by `fallback`, if
///   there is one. Its error is raised by how far it last differed from an answer of the worker to the same state.
///
/// Thread-safe: no. Realtime-safe: no.
class Front {
 public:
  struct Config {
    Duration deadline{};  ///< 0: three times the median of the newest answers with a force, at least kMinDeadline
    /// 0: ten times that median, at least kMinDead; kDeadAtFirst before there is an answer with a force.
    Duration dead{};
    Duration start = std::chrono::minutes(2);  ///< from its launch to its opening; > 0
    Duration retry_min = std::chrono::milliseconds(500);
    Duration retry_max = std::chrono::seconds(30);
    Physics fallback{};
  };
  static constexpr Duration kMinDeadline = std::chrono::milliseconds(50);
  static constexpr Duration kMinDead = std::chrono::milliseconds(500);
  static constexpr Duration kDeadAtFirst = std::chrono::seconds(10);

  enum class Worker : std::uint8_t {
    kAbsent = 1,    ///< the next one is not due yet
    kStarting = 2,  ///< launched; its stream is not open
    kIdle = 3,      ///< waits for a state
    kBusy = 4,      ///< has one
  };

  struct Stats {
    Worker worker = Worker::kAbsent;
    std::uint64_t launches = 0;
    std::uint64_t asked = 0;         ///< states that went to a worker
    std::uint64_t answers = 0;       ///< in time
    std::uint64_t unknown = 0;       ///< of these, without a force
    std::uint64_t late = 0;          ///< not sent
    std::uint64_t refused = 0;       ///< unusable answers, not sent
    std::string_view why_refused{};  ///< the newest of them
    std::uint64_t fallback = 0;      ///< answers of the fallback
    double fallback_difference = 0;  ///< N, its last distance to an answer of the worker
    std::uint64_t given_up = 0;      ///< workers
    std::string why_given_up{};      ///< the last of them
    Duration median{};               ///< of the newest answers with a force, late ones too
  };

  /// Throws std::invalid_argument "FIELD = VALUE: expected …". The first worker is due at once.
  Front(const Config& config, LocalTime now);

  // What happens:

  void see(const Seen& seen);
  /// The worker's stream is open.
  void opened();
  /// An answer to the state that was asked last, or what is wrong with what came (stream.h).
  void answered(LocalTime now, const Touch& touch);
  void refused(std::string_view why);
  /// The worker's stream or its program has ended, for this reason.
  void ended(LocalTime now, const std::string& why);

  // What is to be done; call it until it is empty:

  struct Launch {};  ///< start a worker
  struct GiveUp {    ///< kill it, and all that it has started
    std::string why;
  };
  struct Ask {  ///< send this state to the worker
    std::uint64_t sequence = 0;
    DeviceState hand{};
  };
  using Order = std::variant<Launch, GiveUp, Ask, Reply>;
  std::optional<Order> turn(LocalTime now);

  /// The latest time for the next turn; LocalTime::max() while it waits for something to happen.
  LocalTime next_turn() const;

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
  LocalTime due_;                          ///< kAbsent: of the next launch; kStarting: the end of patience
  Duration wait_;                          ///< after the next failure
  std::optional<LocalTime> first_answer_;  ///< of this worker
  LocalTime asked_{};
  std::uint64_t sequence_ = 0;
  Seen question_{};
  std::optional<Seen> newest_;    ///< not yet sent to a worker
  bool newest_answered_ = false;  ///< … but answered by the fallback
  std::optional<Reply> answer_;
  std::optional<std::string> to_give_up_;
  std::array<Duration, kTimes> times_{};
  std::size_t count_ = 0;  ///< of answers with a force
  Stats stats_;
};

}  // namespace tendon::worker
