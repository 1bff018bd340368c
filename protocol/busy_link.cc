// SPDX-License-Identifier: Apache-2.0
#include "protocol/busy_link.h"

#include <algorithm>
#include <utility>

namespace tendon {

bool BusyLink::look(LocalTime& now) {
  if (size_ > 0) return true;
  const LocalTime before = now;
  size_ = link_.receive(from_, ahead_);
  now = size_ > 0 ? link_.arrived(now) : link_.present(now);
  if (size_ == 0) {
    nothing_ = before;
    return false;
  }
  looked_ = now;
  alone_ = now - nothing_ <= kAtOnce;
  return true;
}

std::size_t BusyLink::receive(Address& from, std::span<std::byte> buffer) {
  by_look_ = size_ > 0;
  if (!by_look_) return std::exchange(alone_, false) ? 0 : link_.receive(from, buffer);
  from = from_;
  std::copy_n(ahead_.begin(), std::min(size_, buffer.size()), buffer.begin());
  return std::exchange(size_, 0);
}

}  // namespace tendon
