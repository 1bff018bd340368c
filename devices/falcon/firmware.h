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

/// The Falcon forgets its firmware when it loses power; the host gives it anew. Novint's licence lets nobody pass the
/// firmware on, so Tendon has none: the user names a file that came with the device.
namespace tendon::falcon {

/// What to do with a file that looks like firmware but is none of the known ones.
enum class UnknownFirmware : std::uint8_t { kRefuse, kAccept };

/// The firmware in `bytes`: 4 to 64 KiB that begin with AA 08, the key of TI's boot loader, and have the SHA-256 of one
/// of the files that libnifalcon's users have loaded (the hashes are in firmware.cc). Throws std::runtime_error with a
/// sentence that begins with `name`, says what was found and what was expected.
std::vector<std::uint8_t> check_firmware(std::vector<std::uint8_t> bytes, const std::string& name,
                                         UnknownFirmware unknown);

/// The same for the content of a file, of which no more than is needed is read.
std::vector<std::uint8_t> read_firmware(std::istream& file, const std::string& name, UnknownFirmware unknown);

/// Gives a Falcon its firmware without ever waiting. The device's processor starts its boot loader, which echoes what
/// it gets; each echo is compared with what was sent. Source: libnifalcon, FalconCommLibUSB.cpp (setFirmwareMode) and
/// FalconFirmware.cpp. Some 2 s for 8 KiB.
///
///     reset ─▶ greet (9600 baud; again until answered, at most 100 times) ─▶ "A" (142 857 baud) ─▶ 62 bytes at a time
///
/// Thread-safe: no. Realtime-safe: yes.
class FirmwareLoader {
 public:
  enum class Progress : std::uint8_t { kBusy, kDone, kFailed };

  /// `image` must outlive the loader.
  explicit FirmwareLoader(std::span<const std::uint8_t> image) noexcept : image_(image) {}

  /// From the beginning.
  void restart() noexcept;

  /// What the device has said: serial data, without the chip's status bytes.
  void receive(std::span<const std::uint8_t> bytes) noexcept;

  /// Sends what is to be sent next. After kDone the chip still has the loader's settings.
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
  std::size_t sent_ = 0;  ///< bytes of the image that came back as they should
  int greetings_ = 0;
  bool said_ = false;  ///< and waits for the answer since:
  LocalTime since_{};
  std::array<std::uint8_t, usb::kPacketSize> heard_{};
  std::size_t heard_size_ = 0;
  bool too_much_ = false;  ///< heard more than any answer has
};

}  // namespace tendon::falcon
