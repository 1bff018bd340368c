// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "devices/usb/usb.h"

namespace tendon::usb {
namespace {

[[noreturn]] void refuse() {
  throw std::runtime_error(
      "this build knows no USB: it was made without libusb; install libusb-1.0-0-dev and configure it again");
}

}  // namespace

std::vector<PluggedIn> plugged_in() { refuse(); }

std::unique_ptr<Pipe> open_pipe(const PipeConfig&) { refuse(); }

}  // namespace tendon::usb
