// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "devices/usb/usb.h"

namespace tendon::usb {
namespace {

[[noreturn]] void refuse() {
  throw std::runtime_error("this build does not support USB; install libusb-1.0-0-dev, then configure and build again");
}

}  // namespace

std::vector<PluggedIn> plugged_in() { refuse(); }

std::unique_ptr<Pipe> open_pipe(const PipeConfig&) { refuse(); }

}  // namespace tendon::usb
