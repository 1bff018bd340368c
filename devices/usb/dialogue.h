// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/base/time.h"
#include "devices/counts.h"
#include "devices/usb/pipe.h"

namespace tendon::usb {

/// What a driver and its device say to each other over a `Pipe`, one connection after another: who is there, which
/// request still waits for its answer, since when nothing was heard, and what went wrong how often. The driver gives
/// the bytes their meaning.
///
/// In each turn the driver calls, in this order:
///
///     begin(now)                       true: another connection, or none; the driver starts over, with `restart`
///     receive(…)                       each packet; for an answer `hear`, and `believe` when it can be true
///     silent(), lost_count()           for 100 ms: the driver gives the device up or has it homed again
///     trusted()                        false for 10 ms without an answer that can be true: then no force
///     may_send(…), send(…)             the next request
///
/// **Requests.** Up to `Patience::most_under_way` of them go without an answer; one answer is an answer to all. When
/// the oldest waits for `Patience::answer`, they are taken for lost, and the next request may be sent. A request that
/// ends a force waits for none of this: it is sent at once.
///
/// **Force.** The device is taken to hold what it was told last, until its own watchdog ends it.
///
/// Thread-safe: `counts` from any thread, the rest from one. Realtime-safe: all but the constructor.
class Dialogue {
 public:
  struct Patience {
    int most_under_way = 1;                          ///< requests without an answer, ≥ 1
    Duration answer = std::chrono::milliseconds(5);  ///< then the answer is late: it is asked for again
  };

  /// Without an answer that can be true for so long (ten periods of 1 kHz), the device gets no force.
  static constexpr Duration kQuiet = std::chrono::milliseconds(10);
  /// After so long a silence the device is as good as unplugged; after so long without an answer that can be true, its
  /// encoders have lost count. A loop that was stopped for so long by its machine has the answers waiting, and takes
  /// them before it looks.
  static constexpr Duration kLost = std::chrono::milliseconds(100);
  /// So many answers in a row must say that a device is homed, or that it is not: one garbled byte can say either.
  static constexpr int kSure = 10;

  /// `watchdog`: the device's own ends a force so long after the last request; zero: it has none.
  explicit Dialogue(std::unique_ptr<Pipe> pipe, Duration watchdog = Duration::zero());

  /// Begins the turn at `now`, which all that follows happens at. True when this is not the connection of the turn
  /// before; `connected` says whether there is one.
  bool begin(LocalTime now) noexcept;
  bool connected() const noexcept { return connection_ != 0; }
  LocalTime now() const noexcept { return now_; }

  /// The device has just been opened or set up: nothing is under way, and it holds no force as far as anybody knows.
  void restart(const Patience& patience) noexcept;
  /// From now on.
  void set_patience(const Patience& patience) noexcept { patience_ = patience; }

  /// Hands each packet that has come to `take`, as std::span<const std::uint8_t>.
  template <class Take>
  void receive(const Take& take) noexcept {
    std::array<std::uint8_t, kPacketSize> packet;
    while (const std::size_t size = pipe_->read(packet)) take(std::span<const std::uint8_t>(packet).first(size));
  }
  /// A well-formed answer has come.
  void hear() noexcept;
  /// … and what it says can be true.
  void believe() noexcept;

  Duration since_heard() const noexcept { return now_ - heard_; }
  bool silent() const noexcept { return since_heard() >= kLost; }
  bool lost_count() const noexcept { return now_ - believed_ >= kLost; }
  bool trusted() const noexcept { return now_ - believed_ < kQuiet; }

  bool awaits_answer() const noexcept { return under_way_ > 0; }
  bool holds_force() const noexcept;
  /// Whether a request may be sent now; `exerts`: it commands a force other than zero.
  bool may_send(bool exerts) const noexcept;
  /// Sends one. False when the pipe has no room: then nothing is changed.
  bool send(std::span<const std::uint8_t> request, bool exerts) noexcept;

  /// Ends the connection from our side: the device is looked for again.
  void reopen() noexcept { pipe_->reopen(); }

  /// For what is no request with an answer: a serial chip's set-up, a boot loader.
  Pipe& pipe() noexcept { return *pipe_; }

  DeviceCountersKept& counters() noexcept { return counters_; }
  DeviceCounts counts() const noexcept { return counters_.counts(); }

 private:
  bool late() const noexcept { return under_way_ > 0 && now_ - asked_ >= patience_.answer; }

  std::unique_ptr<Pipe> pipe_;
  Duration watchdog_;
  std::uint32_t connection_ = 0;
  LocalTime now_{};

  Patience patience_;
  int under_way_ = 0;      ///< requests sent since the last answer
  bool answered_ = false;  ///< has answered since `restart`
  LocalTime asked_{};      ///< when the first of those under way was sent
  LocalTime told_{};       ///< when the last request of all was sent
  bool exerts_ = false;    ///< it commanded a force
  LocalTime heard_{};      ///< when the last answer came
  LocalTime believed_{};   ///< when the last one came that can be true

  DeviceCountersKept counters_;
};

}  // namespace tendon::usb
