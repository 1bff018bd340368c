// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/motion.h"
#include "tests/devices/woodenhaptics/published_arm.h"
#include "tests/support/dice.h"

namespace tendon {

/// A WoodenHaptics at the end of its cable: the published firmware (haptikfabrikenapi, firmware/main.cpp) step by step,
/// its amplifiers, the arm, and a full-speed bus that carries one report each way in each frame of 1 ms. Shares no code
/// with the driver. Nothing in it waits or reads a clock.
///
///     firmware:  for ever: say the counters, which waits until the host takes them; wait for a report; take the
///                newest; when it has 14 bytes: amplifiers on, watchdog set to 0.5 s, obey it
///     watchdog:  an interrupt of its own: amplifiers off, no current
class FakeWoodenHaptics {
 public:
  struct Options {
    std::string_view model = "woodenhaptics_v2019";
    Duration boot{};  ///< from the plug until the firmware's loop begins: its lamps take a second
    /// The board has power of its own: counters and watchdog go on while the cable is out.
    bool own_supply = false;
  };

  enum class Fault {
    kNone,
    kSilent,       ///< hears, and does what it is told, but says nothing more
    kHangs,        ///< its loop stands still; the watchdog is an interrupt, and does not
    kDropsSome,    ///< one report of three is lost
    kGarblesSome,  ///< one report of three has a wrong byte
    kGarblesAll,   ///< every report has an `info` that is none
    kCutsAll,      ///< every report lacks its last byte
    kPadsAll,      ///< every report has 64 bytes
    kBabbles,      ///< says packets of its own beside the reports
    kBabblesOnly,  ///< and nothing else
    kJumps,        ///< an encoder has lost count
    kForgets,      ///< the board was reset: its counters begin at 0 where the arm is
    kCalibrates,   ///< somebody presses the calibrate button, wherever the arm is
    kStalls,       ///< refuses data
  };
  static constexpr std::array kFaults = {Fault::kSilent,      Fault::kHangs,   Fault::kDropsSome, Fault::kGarblesSome,
                                         Fault::kGarblesAll,  Fault::kCutsAll, Fault::kPadsAll,   Fault::kBabbles,
                                         Fault::kBabblesOnly, Fault::kJumps,   Fault::kForgets,   Fault::kCalibrates,
                                         Fault::kStalls};

  explicit FakeWoodenHaptics(const Options& options);

  // The host's side of the cable.
  bool plugged() const { return plugged_; }
  int times_plugged() const { return times_plugged_; }
  /// There are none: it is no serial chip.
  bool request(LocalTime, std::uint8_t, std::uint16_t) { return false; }
  bool write(LocalTime now, std::span<const std::uint8_t> bytes);
  /// When an IN transfer that waits may end.
  LocalTime next_in() const;
  /// What it brings: empty when there is nothing yet.
  std::vector<std::uint8_t> take_in(LocalTime now);
  /// The node is closed: what waits for the bus is cancelled.
  void cancel();
  /// The process that held the node is dead: nothing is sent and nothing taken any more.
  void lose_host();

  /// Time goes on.
  void advance(LocalTime now);

  // The user's side.
  void plug();
  void unplug();
  void move_to(const Vec3& position) { angles_ = arm_.angles_at(position); }  ///< m, of the workspace
  void turn_to(const Vec3& angles) { angles_ = angles; }                      ///< rad
  void press_calibrate() { calibrate_ = true; }
  void close_switch(bool closed) { switch_closed_ = closed; }
  void set_fault(Fault fault);

  // What an onlooker sees.
  const published_arm::Arm& arm() const { return arm_; }
  bool calibrated() const { return calibrated_ && !calibrate_ && fault_ != Fault::kJumps; }
  bool amplifiers_on() const { return amplifiers_on_; }
  bool pushes() const { return amplifiers_on_ && current_ma_ != std::array<int, 3>{}; }
  /// 0 to 1, as the amplifiers get it: a half is no current, 0.1 and 0.9 are the full scale.
  double pulse_width(std::size_t motor) const;
  /// N, on the hand, by virtual work.
  Vec3 force() const;
  Vec3 position() const { return arm_.position_at(angles_); }
  int obeyed() const { return obeyed_; }
  int calibrations() const { return calibrations_; }
  /// Reports that came while the last one had not been taken.
  int most_waiting() const { return most_waiting_; }

 private:
  void frame(LocalTime at);
  void run(LocalTime at);
  void obey(LocalTime at, const std::vector<std::uint8_t>& bytes);
  void say(LocalTime at);
  void reset();
  int counts(std::size_t motor) const;

  Options options_;
  published_arm::Arm arm_;
  Dice dice_{1};
  Fault fault_ = Fault::kNone;
  bool plugged_ = true;
  int times_plugged_ = 1;
  bool host_ = true;

  // The bus
  std::optional<LocalTime> next_frame_;
  std::deque<std::vector<std::uint8_t>> from_host_;
  std::deque<std::pair<LocalTime, std::vector<std::uint8_t>>> to_host_;
  std::optional<std::vector<std::uint8_t>> out_buffer_;  ///< of the endpoint: one report
  std::optional<std::vector<std::uint8_t>> in_buffer_;
  std::optional<LocalTime> boots_;
  int most_waiting_ = 0;

  // The firmware
  bool begun_ = false;           ///< it has said its first report, which nobody asked for
  std::array<int, 3> origin_{};  ///< count of the counter where the arm's angle is 0
  bool calibrate_ = false;       ///< the button's flag
  bool calibrated_ = false;      ///< by command 1, since the last reset
  bool amplifiers_on_ = false;
  std::array<int, 3> current_ma_{};
  std::optional<LocalTime> told_;
  int obeyed_ = 0;
  int calibrations_ = 0;
  int said_ = 0;

  // The arm
  Vec3 angles_ = Vec3::Zero();
  bool switch_closed_ = false;
};

}  // namespace tendon
