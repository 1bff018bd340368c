// SPDX-License-Identifier: Apache-2.0
#include "server/machine/doorbell.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

namespace tendon {

Doorbell::Doorbell() : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "cannot create an eventfd");
}

Doorbell::~Doorbell() { ::close(fd_); }

void Doorbell::ring() noexcept {
  const int saved = errno;
  rung_.store(true, std::memory_order_release);
  const std::uint64_t one = 1;
  // This can only fail if the counter has reached 2⁶⁴ − 2. The descriptor is then readable.
  [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof one);
  errno = saved;
}

void Doorbell::answer() noexcept {
  rung_.exchange(false, std::memory_order_acq_rel);  // acquires the data of the ringing thread
  std::uint64_t rings = 0;
  // This can only fail if there was no ring.
  [[maybe_unused]] const auto got = ::read(fd_, &rings, sizeof rings);
}

}  // namespace tendon
