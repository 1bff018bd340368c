// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <vector>

#include "devices/falcon/firmware.h"
#include "tests/fuzz/target.h"

// The input decides the answers of a boot loader and their timing, and when the cable accepts no data. The loader must
// only report success after it has sent the whole image in order and has received an exact echo of each piece.

using namespace tendon;

namespace {

class Cable final : public usb::Pipe {
 public:
  std::uint32_t connection() noexcept override { return 1; }
  bool request(const usb::Request&) noexcept override { return !full; }
  bool write(std::span<const std::uint8_t> bytes) noexcept override {
    if (full) return false;
    fuzz::require(bytes.size() <= usb::kPacketSize);
    if (sending) {
      fuzz::require(sent.empty() || heard == last);  // the loader must wait for the echo of the previous piece
      sent.insert(sent.end(), bytes.begin(), bytes.end());
    } else if (bytes.size() == 1) {
      sending = true;  // the letter for the baud rate; the image follows
    }
    last.assign(bytes.begin(), bytes.end());
    heard.clear();
    return true;
  }
  bool settled() const noexcept override { return !full; }
  std::size_t read(std::span<std::uint8_t, usb::kPacketSize>) noexcept override { return 0; }
  void reopen() noexcept override {}

  bool full = false;
  bool sending = false;
  std::vector<std::uint8_t> sent;
  std::vector<std::uint8_t> last;   ///< the last written piece
  std::vector<std::uint8_t> heard;  ///< received since then
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  std::array<std::uint8_t, 150> image{};
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<std::uint8_t>(31 * i + 7);
  Cable cable;
  falcon::FirmwareLoader loader(image);
  loader.restart();
  LocalTime now{};
  const auto answer = [&](std::span<const std::uint8_t> bytes) {
    loader.receive(bytes);
    cable.heard.insert(cable.heard.end(), bytes.begin(), bytes.end());
  };
  auto progress = falcon::FirmwareLoader::Progress::kBusy;
  while (!input.empty() && progress == falcon::FirmwareLoader::Progress::kBusy) {
    const std::uint8_t decision = input.byte();
    now += std::chrono::milliseconds(1);
    cable.full = false;
    switch (decision % 8) {
      case 0:
        cable.full = true;
        break;
      case 1:
        now += std::chrono::milliseconds(decision);
        break;
      case 2: {
        const auto noise = input.take(decision / 8);
        answer({reinterpret_cast<const std::uint8_t*>(noise.data()), noise.size()});
        break;
      }
      case 3:
        answer(std::array<std::uint8_t, 5>{0x00, 0x0A, 0x44, 0x2C, 0x0D});
        break;
      case 4:
        answer(std::span(cable.last).first(std::min<std::size_t>(cable.last.size(), decision / 8)));
        break;
      case 5:
        break;
      default:
        answer(std::vector(cable.last));
        break;
    }
    progress = loader.step(now, cable);
  }
  if (progress != falcon::FirmwareLoader::Progress::kDone) return 0;
  fuzz::require(std::equal(image.begin(), image.end(), cable.sent.begin(), cable.sent.end()));
  fuzz::require(cable.heard == cable.last);
  return 0;
}
