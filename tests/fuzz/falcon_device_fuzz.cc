// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>

#include "devices/falcon/falcon_device.h"
#include "tests/fuzz/target.h"

// The input decides which data the cable of a Falcon returns, when it accepts data, and when it is disconnected. Torque
// must only be sent if the device is homed, and must be within the motor limits. The result of `apply` must be finite.

using namespace tendon;

namespace {

class Cable final : public usb::Pipe {
 public:
  explicit Cable(fuzz::Input& input) : input_(input) {}

  std::uint32_t connection() noexcept override { return number; }
  bool request(const usb::Request&) noexcept override { return !full; }
  bool write(std::span<const std::uint8_t> bytes) noexcept override {
    if (full) return false;
    if (bytes.size() != falcon::kPacketBytes) return true;
    const auto packet = falcon::decode(bytes.first<falcon::kPacketBytes>());
    fuzz::require(packet.has_value());
    for (const std::int16_t torque : packet->encoders) {
      fuzz::require(torque == 0 || device->state() == Device::State::kHomed);
      fuzz::require(torque >= -falcon::kMostCounts && torque <= falcon::kMostCounts);
    }
    return true;
  }
  bool settled() const noexcept override { return !full; }
  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override {
    const std::uint8_t decision = input_.byte();
    if (decision == 0) return 0;
    if (decision < 32) {
      const auto noise = input_.take(decision);
      std::transform(noise.begin(), noise.end(), packet.begin(), std::to_integer<std::uint8_t>);
      return noise.size();
    }
    // This is usually a homed device near its previous position.
    std::array<std::uint8_t, falcon::kPacketBytes> reply =
        falcon::encode({.torque = {static_cast<std::int16_t>(decision), 0, static_cast<std::int16_t>(-decision)}});
    reply[13] = static_cast<std::uint8_t>('A' + (decision % 16 == 0 ? 0x30 : 0x70));
    packet[0] = packet[1] = 0;
    std::copy(reply.begin(), reply.end(), packet.begin() + usb::ftdi::kStatusBytes);
    return usb::ftdi::kStatusBytes + reply.size();
  }
  void reopen() noexcept override { ++number; }

  const Device* device = nullptr;
  std::uint32_t number = 1;
  bool full = false;

 private:
  fuzz::Input& input_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  auto owned = std::make_unique<Cable>(input);
  Cable& cable = *owned;
  FalconDevice device({.firmware = std::vector<std::uint8_t>(input.byte() % 2 == 0 ? 0 : 100)}, std::move(owned));
  cable.device = &device;
  LocalTime now{};
  while (!input.empty()) {
    const std::uint8_t decision = input.byte();
    now += std::chrono::milliseconds(decision % 16 == 15 ? 150 : 1);
    cable.full = decision / 16 == 1;
    if (decision / 16 == 2) cable.number = 0;
    if (decision / 16 == 3) ++cable.number;
    const auto sample = device.read(now);
    fuzz::require(!sample || (sample->position.allFinite() && device.state() == Device::State::kHomed));
    fuzz::require(device.apply(Vec3(decision, 1e3 * decision, -5)).allFinite());
  }
  return 0;
}
