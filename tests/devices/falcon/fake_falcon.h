// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/motion.h"
#include "tests/devices/usb/usb_model.h"
#include "tests/support/dice.h"

namespace tendon {

/// Models the cable, the FTDI chip, the boot loader, the firmware, the encoders and the motors from what is known about
/// the protocol, without any code of the driver.
class FakeFalcon final : public UsbModel {
 public:
  struct Options {
    bool has_firmware = true;
    bool is_homed = false;
    std::size_t firmware_bytes = 8192;   ///< the image starts after this many bytes
    bool answers_greeting_late = false;  ///< some machines receive a byte 00 first
    bool knows_flush_character = true;
    /// Firmware and home position outlive the cable, which then only powers the chip.
    bool own_supply = false;
    Duration thinking = std::chrono::microseconds(50);
  };

  enum class Fault {
    kNone,
    kSilent,         ///< executes commands but sends nothing
    kDropsSome,      ///< loses one reply in three
    kGarblesSome,    ///< corrupts a byte of one reply in three
    kGarblesAll,     ///< sends an invalid nibble in each reply
    kCutsAll,        ///< every reply is truncated
    kSplits,         ///< sends each reply in two IN packets
    kBabbles,        ///< adds unsolicited bytes between the replies
    kBabblesOnly,    ///< sends only unsolicited bytes
    kJumps,          ///< the encoders lose count
    kLosesHome,      ///< reports a leg that is not homed
    kLosesFirmware,  ///< power loss: the boot loader runs without firmware
    kOutOfReach,     ///< encoder counts without a valid position
    kStalls,         ///< stalls requests and data
  };
  static constexpr std::array kFaults = {Fault::kSilent,  Fault::kDropsSome, Fault::kGarblesSome,   Fault::kGarblesAll,
                                         Fault::kCutsAll, Fault::kSplits,    Fault::kBabbles,       Fault::kBabblesOnly,
                                         Fault::kJumps,   Fault::kLosesHome, Fault::kLosesFirmware, Fault::kOutOfReach,
                                         Fault::kStalls};

  explicit FakeFalcon(const Options& options);

  bool plugged() const { return plugged_; }
  int times_plugged() const { return times_plugged_; }
  std::span<const std::uint8_t> descriptors() const override;
  bool request(LocalTime now, std::uint8_t request, std::uint16_t value) override;
  bool write(LocalTime now, std::span<const std::uint8_t> bytes) override;
  LocalTime next_in() const override;
  std::vector<std::uint8_t> take_in(LocalTime now) override;

  void plug() override { plugged_ = true, ++times_plugged_; }
  void unplug() override;
  void move_to(const Vec3& position) { position_ = position; }  ///< m, device frame
  /// Moves the grip to both stops, which homes the device. This has no effect unless the host has requested it.
  void pull_through();
  void press(std::uint8_t buttons) { buttons_ = buttons; }
  void set_fault(Fault fault);

  bool running() const { return mode_ == Mode::kRunning; }
  bool homed() const { return homed_ == 7; }
  const std::array<std::int16_t, 3>& torque() const { return torque_; }
  bool pushes() const { return torque_ != std::array<std::int16_t, 3>{}; }
  /// Force on the hand, N, by virtual work from the published geometry.
  Vec3 force() const;
  const std::vector<std::uint8_t>& image() const { return image_; }
  int commands() const { return commands_; }
  std::uint8_t lamps() const { return lamps_; }
  int latency_ms() const { return latency_ms_; }
  bool heard_garbage() const { return heard_garbage_; }

 private:
  enum class Mode { kGreeting, kGreeted, kLoading, kRunning };

  void reset();
  void hear(LocalTime at, std::uint8_t byte);
  void obey(LocalTime at);
  void reply(LocalTime at);
  void say(LocalTime at, std::span<const std::uint8_t> bytes);
  Duration per_byte() const;

  Options options_;
  Dice dice_{1};
  Fault fault_ = Fault::kNone;
  bool plugged_ = true;
  int times_plugged_ = 1;

  int latency_ms_ = 16;
  std::uint16_t divisor_ = 0x4138;
  std::uint8_t flush_at_ = 0;
  bool dtr_ = false;
  LocalTime last_in_{};
  std::deque<std::pair<LocalTime, std::uint8_t>> rx_;  ///< arrival time of each byte from the processor
  LocalTime tx_free_{};
  LocalTime rx_free_{};
  std::size_t split_left_ = 0;

  Mode mode_;
  std::vector<std::uint8_t> heard_;
  bool heard_garbage_ = false;
  std::vector<std::uint8_t> image_;
  std::uint8_t homed_ = 0;
  bool homing_ = false;
  int commands_ = 0;
  int replies_ = 0;
  std::array<std::int16_t, 3> torque_{};
  std::uint8_t lamps_ = 0;

  Vec3 position_{0, 0, 0.125};
  std::uint8_t buttons_ = 0;
  std::array<int, 3> origin_{};  ///< encoder offset, unknown until homed
};

}  // namespace tendon
