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

/// Exchanges requests and answers with a device over a `Pipe`, and detects missing answers and errors. The bytes are
/// interpreted by the driver, which must call in each turn:
///
///     begin(now)                       true: the connection has changed; the driver starts over with `restart`
///     receive(…)                       each packet; `hear` for an answer, and `believe` if it is plausible
///     silent(), lost_count()           for 100 ms: the driver gives the device up or has it homed again
///     trusted()                        false after 10 ms without a plausible answer: no force
///     may_send(…), send(…)             the next request
///
/// **Requests.** Up to `Patience::most_under_way` requests can be pending, and an answer completes all of them. After
/// `Patience::answer`, they are considered lost and another one can be sent. Requests that end a force do not wait.
///
/// **Force.** The device is assumed to render the last command until its own watchdog expires.
/// Thread-safe: `counts` only. Realtime-safe: all except the constructor.
class Dialogue {
 public:
  struct Patience {
    int most_under_way = 1;  ///< maximum number of pending requests, ≥ 1
    Duration answer = std::chrono::milliseconds(5);
  };

  /// If there is no plausible answer for this time (ten periods of 1 kHz), the force is set to zero.
  static constexpr Duration kQuiet = std::chrono::milliseconds(10);
  /// If there is no answer for this time, the device is considered to be unplugged. If there is no plausible answer,
  /// its encoders have lost counts. If the loop itself was suspended, it first receives the pending answers.
  static constexpr Duration kLost = std::chrono::milliseconds(100);
  static constexpr int kSure = 10;  ///< consecutive answers that it is homed; a single byte may be corrupted

  /// `watchdog` is the timeout of the device's own watchdog, or zero.
  explicit Dialogue(std::unique_ptr<Pipe> pipe, Duration watchdog = Duration::zero());

  bool begin(LocalTime now) noexcept;  ///< starts a turn; returns true if the connection has changed (see `connected`)
  bool connected() const noexcept { return connection_ != 0; }
  LocalTime now() const noexcept { return now_; }

  /// Must be called after opening or setting up the device. Clears all pending requests, and assumes no force.
  void restart(const Patience& patience) noexcept;
  void set_patience(const Patience& patience) noexcept { patience_ = patience; }

  /// Calls take(std::span<const std::uint8_t>) for each packet.
  template <class Take>
  void receive(const Take& take) noexcept {
    std::array<std::uint8_t, kPacketSize> packet;
    while (const std::size_t size = pipe_->read(packet)) take(std::span<const std::uint8_t>(packet).first(size));
  }
  void hear() noexcept;     ///< for each well-formed answer
  void believe() noexcept;  ///< for each plausible answer, after `hear`

  Duration since_heard() const noexcept { return now_ - heard_; }
  bool silent() const noexcept { return since_heard() >= kLost; }
  bool lost_count() const noexcept { return now_ - believed_ >= kLost; }
  bool trusted() const noexcept { return now_ - believed_ < kQuiet; }

  bool awaits_answer() const noexcept { return under_way_ > 0; }
  bool holds_force() const noexcept;
  bool may_send(bool exerts) const noexcept;  ///< `exerts`: the request commands a nonzero force
  bool send(std::span<const std::uint8_t> request, bool exerts) noexcept;  ///< false if the pipe has no room

  void reopen() noexcept { pipe_->reopen(); }

  /// For transfers without an answer, for example to a serial chip or a boot loader.
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
  int under_way_ = 0;
  bool answered_ = false;  ///< since `restart`
  LocalTime asked_{};      ///< time of the first pending request
  LocalTime told_{};
  bool exerts_ = false;  ///< whether it commanded a force
  LocalTime heard_{};
  LocalTime believed_{};  ///< time of the last plausible answer

  DeviceCountersKept counters_;
};

}  // namespace tendon::usb
