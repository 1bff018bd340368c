// SPDX-License-Identifier: Apache-2.0
#include "server/machine/doorbell.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

namespace tendon {

Doorbell::Doorbell() : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "cannot make an eventfd");
}

Doorbell::~Doorbell() { ::close(fd_); }

void Doorbell::ring() noexcept {
  const int saved = errno;
  rung_.store(true, std::memory_order_release);
  const std::uint64_t one = 1;
  // Fails only when 2⁶⁴ − 2 rings are unanswered, and then the bell is ringing already.
  [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof one);
  errno = saved;
}

void Doorbell::answer() noexcept {
  rung_.exchange(false, std::memory_order_acq_rel);  // what was done before a ring is seen; later ones count anew
  std::uint64_t rings = 0;
  // Fails only when nobody has rung.
  [[maybe_unused]] const auto got = ::read(fd_, &rings, sizeof rings);
}

}  // namespace tendon
