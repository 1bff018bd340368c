// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "devices/usb/ftdi.h"
#include "devices/usb/pipe.h"

/// The Falcon loses its firmware when it loses power, and the host must load it again. Novint's license does not permit
/// redistribution, so Tendon contains no firmware: the user names a file that came with the device.
namespace tendon::falcon {

/// Whether to accept a file that looks like firmware but is not one of the known files.
enum class UnknownFirmware : std::uint8_t { kRefuse, kAccept };

/// Returns `bytes` if they are valid firmware: 4 to 64 KiB that begin with AA 08, the key of TI's boot loader, with the
/// SHA-256 of one of the files that users of libnifalcon have loaded (firmware.cc contains the hashes). kAccept skips
/// the comparison of the SHA-256. Otherwise throws std::runtime_error with a sentence that begins with `name` and
/// states what was found and expected.
std::vector<std::uint8_t> check_firmware(std::vector<std::uint8_t> bytes, const std::string& name,
                                         UnknownFirmware unknown);

/// Does the same for a file. Reads at most one byte more than the maximum size of firmware.
std::vector<std::uint8_t> read_firmware(std::istream& file, const std::string& name, UnknownFirmware unknown);

/// Loads the firmware into a Falcon without blocking. A reset starts the boot loader of the device's processor, which
/// echoes every byte; each echo is compared with the bytes sent. Loading 8 KiB takes about 2 s. Source: libnifalcon,
/// FalconCommLibUSB.cpp (setFirmwareMode) and FalconFirmware.cpp.
///
///     reset ─▶ greet (9600 baud; again until answered, at most 100 times) ─▶ "A" (142 857 baud) ─▶ 62 bytes at a time
///
/// Thread-safe: no. Realtime-safe: yes.
class FirmwareLoader {
 public:
  enum class Progress : std::uint8_t { kBusy, kDone, kFailed };

  /// `image` must outlive the loader.
  explicit FirmwareLoader(std::span<const std::uint8_t> image) noexcept : image_(image) {}

  /// Starts again with the reset. Must be called before the first `step`.
  void restart() noexcept;

  /// Adds serial data from the device, without the status bytes of the chip.
  void receive(std::span<const std::uint8_t> bytes) noexcept;

  /// Sends the next bytes if they are due. After kDone, the serial chip still has the settings of the loader.
  Progress step(LocalTime now, usb::Pipe& pipe) noexcept;

 private:
  enum class Stage : std::uint8_t { kReset, kGreet, kSpeedUp, kAutobaud, kSend, kDone, kFailed };

  void enter(Stage stage) noexcept;
  void say(LocalTime now, std::span<const std::uint8_t> bytes, usb::Pipe& pipe) noexcept;
  bool heard(std::span<const std::uint8_t> bytes) const noexcept;
  std::span<const std::uint8_t> chunk() const noexcept;

  std::span<const std::uint8_t> image_;
  Stage stage_ = Stage::kFailed;
  usb::ftdi::Setup setup_{{}};
  std::size_t sent_ = 0;  ///< bytes of the image that were sent and correctly echoed
  int greetings_ = 0;
  bool said_ = false;  ///< something was sent at since_ and awaits its answer
  LocalTime since_{};
  std::array<std::uint8_t, usb::kPacketSize> heard_{};
  std::size_t heard_size_ = 0;
  bool too_much_ = false;  ///< more bytes arrived than any answer has
};

}  // namespace tendon::falcon
