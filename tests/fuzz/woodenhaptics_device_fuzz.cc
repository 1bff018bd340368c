// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <memory>

#include "devices/woodenhaptics/woodenhaptics_device.h"
#include "tests/fuzz/target.h"

// The input decides which data the cable returns, which data it accepts, and when it is disconnected. Current must only
// be sent if the device is homed, and must be within the motor limits. The counters must only be set after the button
// was pressed. The result of `apply` must be finite.

using namespace tendon;

namespace {

class Cable final : public usb::Pipe {
 public:
  explicit Cable(fuzz::Input& input) : input_(input) {}

  std::uint32_t connection() noexcept override { return number; }
  bool request(const usb::Request&) noexcept override {
    fuzz::require(false);  // not a serial chip
    return false;
  }
  bool write(std::span<const std::uint8_t> bytes) noexcept override {
    if (full) return false;
    fuzz::require(bytes.size() == woodenhaptics::kReportBytes);
    const auto field = [&](std::size_t i) { return static_cast<std::int16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8); };
    const int command = field(3);
    fuzz::require(command == 0 || command == 1);
    if (command == 1) {
      fuzz::require(device->state() == Device::State::kUnhomed && asked >= 10);
      fuzz::require(field(0) == 0 && field(1) == 0 && field(2) == 0);
      for (std::size_t i = 0; i < 3; ++i) counters[i] = field(4 + i);
      flag = false;
      asked = 0;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      fuzz::require(field(i) == 0 || device->state() == Device::State::kHomed);
      fuzz::require(std::abs(field(i)) <= 2000);
    }
    return true;
  }
  bool settled() const noexcept override { return !full; }
  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override {
    const std::uint8_t decision = input_.byte();
    if (decision == 0) return 0;
    if (decision < 24) {
      const auto noise = input_.take(decision);
      std::transform(noise.begin(), noise.end(), packet.begin(), std::to_integer<std::uint8_t>);
      return noise.size() == woodenhaptics::kReportBytes ? 0 : noise.size();
    }
    if (decision % 16 == 15) flag = !flag;
    if (decision % 16 == 14) counters[decision % 3] = static_cast<std::int16_t>(input_.byte() * 256 + decision);
    counters[decision % 3] = static_cast<std::int16_t>(counters[decision % 3] + decision % 32 - 16);
    const std::array<std::int16_t, 7> fields = {
        counters[0], counters[1], counters[2], 0, 0, 0, flag ? std::int16_t{1} : std::int16_t{0}};
    for (std::size_t i = 0; i < fields.size(); ++i) {
      packet[2 * i] = static_cast<std::uint8_t>(fields[i] & 255);
      packet[2 * i + 1] = static_cast<std::uint8_t>((fields[i] >> 8) & 255);
    }
    asked = flag ? asked + 1 : 0;
    return woodenhaptics::kReportBytes;
  }
  void reopen() noexcept override {
    ++number;
    asked = 0;
  }

  const Device* device = nullptr;
  std::uint32_t number = 1;
  bool full = false;
  bool flag = false;
  int asked = 0;  ///< consecutive reports with a pressed button
  std::array<std::int16_t, 3> counters{};

 private:
  fuzz::Input& input_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  auto owned = std::make_unique<Cable>(input);
  Cable& cable = *owned;
  const auto models = woodenhaptics::models();
  const WoodenHapticsDevice::Config config{.model = &models[input.byte() % models.size()]};
  const auto device = std::make_unique<WoodenHapticsDevice>(config, std::move(owned));
  cable.device = device.get();
  LocalTime now{};
  while (!input.empty()) {
    const std::uint8_t decision = input.byte();
    now += std::chrono::milliseconds(decision % 16 == 15 ? 150 : 1);
    cable.full = decision / 16 == 1;
    if (decision / 16 == 2) cable.number = 0;
    if (decision / 16 == 3) cable.reopen();
    const auto sample = device->read(now);
    fuzz::require(!sample || (sample->position.allFinite() && device->state() == Device::State::kHomed));
    fuzz::require(device->apply(Vec3(decision, 1e3 * decision, -5)).allFinite());
  }
  return 0;
}
