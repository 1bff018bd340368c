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

/// The request and reply protocol between a driver and its device over a `Pipe`, for one connection after another. It
/// tracks the connection, which requests are unanswered, how long the device has been silent, and how often errors
/// occur. The driver interprets the bytes.
///
/// In each turn, the driver makes these calls in this order:
///
///     begin(now)                       true: the connection has changed; the driver starts over with `restart`
///     receive(…)                       each packet; `hear` for an answer, and `believe` if it is plausible
///     silent(), lost_count()           for 100 ms: the driver gives the device up or has it homed again
///     trusted()                        false after 10 ms without a plausible answer: no force
///     may_send(…), send(…)             the next request
///
/// **Requests.** Up to `Patience::most_under_way` requests may be unanswered; one answer counts for all of them. When
/// the oldest has waited for `Patience::answer`, they are considered lost, and the next request may be sent. A request
/// that ends a force is always sent immediately.
///
/// **Force.** The device is assumed to hold the last command until its own watchdog ends it.
///
/// Thread-safe: `counts` from any thread, the others from one thread. Realtime-safe: all except the constructor.
class Dialogue {
 public:
  struct Patience {
    int most_under_way = 1;                          ///< maximum number of unanswered requests, ≥ 1
    Duration answer = std::chrono::milliseconds(5);  ///< time after which an answer is late and the request is repeated
  };

  /// After this long without a plausible answer (ten periods of 1 kHz), the device gets no force.
  static constexpr Duration kQuiet = std::chrono::milliseconds(10);
  /// After this much silence, the device is treated as disconnected; after this long without a plausible answer, its
  /// encoders have lost counts. A loop that was suspended for this long finds the answers waiting and receives them
  /// before it checks.
  static constexpr Duration kLost = std::chrono::milliseconds(100);
  /// Number of consecutive answers that must agree on whether a device is homed, because one corrupted byte can say
  /// either.
  static constexpr int kSure = 10;

  /// `watchdog` is the time after the last request at which the device itself ends a force; zero: none.
  explicit Dialogue(std::unique_ptr<Pipe> pipe, Duration watchdog = Duration::zero());

  /// Begins a turn; all following calls happen at `now`. Returns true if the connection has changed since the last
  /// turn. `connected` tells whether there is one.
  bool begin(LocalTime now) noexcept;
  bool connected() const noexcept { return connection_ != 0; }
  LocalTime now() const noexcept { return now_; }

  /// Call after the device was opened or set up. No request is unanswered, and the device is assumed to hold no force.
  void restart(const Patience& patience) noexcept;
  void set_patience(const Patience& patience) noexcept { patience_ = patience; }

  /// Passes each received packet to `take`, as std::span<const std::uint8_t>.
  template <class Take>
  void receive(const Take& take) noexcept {
    std::array<std::uint8_t, kPacketSize> packet;
    while (const std::size_t size = pipe_->read(packet)) take(std::span<const std::uint8_t>(packet).first(size));
  }
  /// Call for each well-formed answer.
  void hear() noexcept;
  /// Call in addition if the answer is plausible.
  void believe() noexcept;

  Duration since_heard() const noexcept { return now_ - heard_; }
  bool silent() const noexcept { return since_heard() >= kLost; }
  bool lost_count() const noexcept { return now_ - believed_ >= kLost; }
  bool trusted() const noexcept { return now_ - believed_ < kQuiet; }

  bool awaits_answer() const noexcept { return under_way_ > 0; }
  bool holds_force() const noexcept;
  /// Returns true if a request may be sent now. `exerts` means that it commands a force other than zero.
  bool may_send(bool exerts) const noexcept;
  /// Sends a request. Returns false, and changes nothing, if the pipe has no room.
  bool send(std::span<const std::uint8_t> request, bool exerts) noexcept;

  /// Closes the device, and opens it again if it is still plugged in.
  void reopen() noexcept { pipe_->reopen(); }

  /// For transfers without an answer, such as the setup of a serial chip or a boot loader.
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
  int under_way_ = 0;      ///< number of requests sent since the last answer
  bool answered_ = false;  ///< the device has answered since `restart`
  LocalTime asked_{};      ///< time of the first unanswered request
  LocalTime told_{};       ///< time of the last request
  bool exerts_ = false;    ///< the last request commanded a force
  LocalTime heard_{};      ///< time of the last answer
  LocalTime believed_{};   ///< time of the last plausible answer

  DeviceCountersKept counters_;
};

}  // namespace tendon::usb
