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

/// The Falcon forgets its firmware when it loses power; the host then loads it again. Novint's licence lets nobody pass
/// the firmware on, so Tendon contains none: the user names a file that came with the device.
namespace tendon::falcon {

/// Whether to accept a file that looks like firmware but is not one of the known files.
enum class UnknownFirmware : std::uint8_t { kRefuse, kAccept };

/// Returns `bytes` when they are firmware: 4 to 64 KiB that begin with AA 08, the key of TI's boot loader, and have the
/// SHA-256 of one of the files that libnifalcon's users have loaded (the hashes are in firmware.cc). kAccept leaves out
/// the comparison of the SHA-256. Otherwise throws std::runtime_error with a sentence that begins with `name` and says
/// what was found and what was expected.
std::vector<std::uint8_t> check_firmware(std::vector<std::uint8_t> bytes, const std::string& name,
                                         UnknownFirmware unknown);

/// The same for the content of a file. Reads at most one byte more than firmware may have.
std::vector<std::uint8_t> read_firmware(std::istream& file, const std::string& name, UnknownFirmware unknown);

/// Loads the firmware into a Falcon; no call waits. A reset starts the boot loader of the device's processor, which
/// echoes every byte; each echo is compared with the bytes that were sent. 8 KiB take some 2 s. Source: libnifalcon,
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

  /// Begins again with the reset. Call it before the first `step`.
  void restart() noexcept;

  /// Takes serial data from the device, without the chip's status bytes.
  void receive(std::span<const std::uint8_t> bytes) noexcept;

  /// Sends the next bytes when it is their turn. After kDone the serial chip still has the loader's settings.
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
  std::size_t sent_ = 0;  ///< bytes of the image that were sent and echoed correctly
  int greetings_ = 0;
  bool said_ = false;  ///< something was sent, at since_, and its answer is awaited
  LocalTime since_{};
  std::array<std::uint8_t, usb::kPacketSize> heard_{};
  std::size_t heard_size_ = 0;
  bool too_much_ = false;  ///< more bytes came than any answer has
};

}  // namespace tendon::falcon
