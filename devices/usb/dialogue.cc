// SPDX-License-Identifier: Apache-2.0
#include "devices/usb/dialogue.h"

#include <utility>

namespace tendon::usb {

Dialogue::Dialogue(std::unique_ptr<Pipe> pipe, Duration watchdog) : pipe_(std::move(pipe)), watchdog_(watchdog) {}

bool Dialogue::begin(LocalTime now) noexcept {
  now_ = now;
  const std::uint32_t before = std::exchange(connection_, pipe_->connection());
  return connection_ != before;
}

void Dialogue::restart(const Patience& patience) noexcept {
  patience_ = patience;
  under_way_ = 0;
  answered_ = false;
  exerts_ = false;
}

void Dialogue::hear() noexcept {
  under_way_ = 0;
  answered_ = true;
  heard_ = now_;
}

void Dialogue::believe() noexcept {
  counters_.add(DeviceCount::kAnswers);
  believed_ = now_;
}

bool Dialogue::holds_force() const noexcept {
  return exerts_ && (watchdog_ == Duration::zero() || now_ - told_ < watchdog_);
}

bool Dialogue::may_send(bool exerts) const noexcept {
  const bool lets_go = !exerts && holds_force();
  return under_way_ < patience_.most_under_way || late() || lets_go;
}

bool Dialogue::send(std::span<const std::uint8_t> request, bool exerts) noexcept {
  if (!pipe_->write(request)) return false;
  // This is not counted if the device is still starting.
  if (late() && answered_) counters_.add(DeviceCount::kUnanswered);
  if (late() || under_way_ == 0) {
    asked_ = now_;
    under_way_ = 0;
  }
  ++under_way_;
  told_ = now_;
  exerts_ = exerts;
  return true;
}

}  // namespace tendon::usb
