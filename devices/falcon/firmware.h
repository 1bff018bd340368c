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

/// The firmware of the Falcon must be loaded by the host whenever the device was switched on. It is not included in
/// Tendon because Novint's license does not allow this. It must be loaded from a file that came with the device.
namespace tendon::falcon {

/// For files that look like firmware but are not known.
enum class UnknownFirmware : std::uint8_t { kRefuse, kAccept };

/// Returns `bytes` if they contain 4 to 64 KiB, starting with AA 08, the key of TI's boot loader, and have the SHA-256
/// of a file that has been used with libnifalcon (see firmware.cc). kAccept does not check the SHA-256. Throws
/// std::runtime_error with a sentence starting with `name` otherwise.
std::vector<std::uint8_t> check_firmware(std::vector<std::uint8_t> bytes, const std::string& name,
                                         UnknownFirmware unknown);

std::vector<std::uint8_t> read_firmware(std::istream& file, const std::string& name, UnknownFirmware unknown);

/// Loads the firmware without blocking, and compares the echoes of the boot loader. 8 KiB take about 2 s.
///
///     reset ─▶ greet (9600 baud; again until answered, at most 100 times) ─▶ "A" (142 857 baud) ─▶ 62 bytes at a time
/// Source: libnifalcon, FalconCommLibUSB.cpp (setFirmwareMode) and FalconFirmware.cpp.
/// Thread-safe: no. Realtime-safe: yes.
class FirmwareLoader {
 public:
  enum class Progress : std::uint8_t { kBusy, kDone, kFailed };

  /// `image` must outlive the loader.
  explicit FirmwareLoader(std::span<const std::uint8_t> image) noexcept : image_(image) {}

  /// Starts again with the reset. Must be called before the first `step`.
  void restart() noexcept;

  /// `bytes` must not include the status bytes of the serial chip.
  void receive(std::span<const std::uint8_t> bytes) noexcept;

  /// Sends more bytes if possible. After kDone, the serial chip still uses the loader's settings.
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
  std::size_t sent_ = 0;  ///< bytes that were echoed correctly
  int greetings_ = 0;
  bool said_ = false;  ///< waiting for an answer since since_
  LocalTime since_{};
  std::array<std::uint8_t, usb::kPacketSize> heard_{};
  std::size_t heard_size_ = 0;
  bool too_much_ = false;  ///< unexpected bytes were received
};

}  // namespace tendon::falcon
