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

/// Models the published firmware (haptikfabrikenapi, firmware/main.cpp) step by step, its amplifiers, the arm, and a
/// full-speed bus with one report per direction in each frame of 1 ms. It shares no code with the driver.
///
///     firmware:  loop: send the counters and wait until the host reads them; wait for a report; take the newest;
///                if it has 14 bytes: amplifiers on, watchdog set to 0.5 s, execute it
///     watchdog:  separate interrupt: amplifiers off, no current
class FakeWoodenHaptics {
 public:
  struct Options {
    std::string_view model = "woodenhaptics_v2019";
    Duration boot{};  ///< from plug to the start of the firmware loop (LED test of one second)
    /// With a separate supply, the counters and the watchdog are not stopped if the board is unplugged.
    bool own_supply = false;
  };

  enum class Fault {
    kNone,
    kSilent,       ///< executes commands but sends nothing
    kHangs,        ///< the main loop hangs; the watchdog interrupt still runs
    kDropsSome,    ///< loses one report in three
    kGarblesSome,  ///< corrupts a byte of one report in three
    kGarblesAll,   ///< puts an invalid `info` in every report
    kCutsAll,      ///< removes one byte from each report
    kPadsAll,      ///< pads every report to 64 bytes
    kBabbles,      ///< adds unsolicited packets between the reports
    kBabblesOnly,  ///< sends only unsolicited packets
    kJumps,        ///< an encoder loses count
    kForgets,      ///< board reset: counters restart at 0
    kCalibrates,   ///< calibrate button pressed in an arbitrary pose
    kStalls,       ///< refuses data
  };
  static constexpr std::array kFaults = {Fault::kSilent,      Fault::kHangs,   Fault::kDropsSome, Fault::kGarblesSome,
                                         Fault::kGarblesAll,  Fault::kCutsAll, Fault::kPadsAll,   Fault::kBabbles,
                                         Fault::kBabblesOnly, Fault::kJumps,   Fault::kForgets,   Fault::kCalibrates,
                                         Fault::kStalls};

  explicit FakeWoodenHaptics(const Options& options);

  bool plugged() const { return plugged_; }
  int times_plugged() const { return times_plugged_; }
  /// The board is not a serial chip, so it does not have any vendor requests.
  bool request(LocalTime, std::uint8_t, std::uint16_t) { return false; }
  bool write(LocalTime now, std::span<const std::uint8_t> bytes);
  LocalTime next_in() const;
  std::vector<std::uint8_t> take_in(LocalTime now);
  void cancel();

  void advance(LocalTime now);

  void plug();
  void unplug();
  void move_to(const Vec3& position) { angles_ = arm_.angles_at(position); }  ///< m, workspace frame
  void turn_to(const Vec3& angles) { angles_ = angles; }                      ///< rad
  void press_calibrate() { calibrate_ = true; }
  void close_switch(bool closed) { switch_closed_ = closed; }
  void set_fault(Fault fault);

  const published_arm::Arm& arm() const { return arm_; }
  bool calibrated() const { return calibrated_ && !calibrate_ && fault_ != Fault::kJumps; }
  bool amplifiers_on() const { return amplifiers_on_; }
  bool pushes() const { return amplifiers_on_ && current_ma_ != std::array<int, 3>{}; }
  /// The duty cycle at the amplifiers: 0.5 is zero current, and 0.1 and 0.9 are full scale.
  double pulse_width(std::size_t motor) const;
  /// Force on the hand, N, by virtual work.
  Vec3 force() const;
  Vec3 position() const { return arm_.position_at(angles_); }
  int obeyed() const { return obeyed_; }
  int calibrations() const { return calibrations_; }
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

  std::optional<LocalTime> next_frame_;
  std::deque<std::vector<std::uint8_t>> from_host_;
  std::deque<std::pair<LocalTime, std::vector<std::uint8_t>>> to_host_;
  std::optional<std::vector<std::uint8_t>> out_buffer_;  ///< endpoint buffer for one report
  std::optional<std::vector<std::uint8_t>> in_buffer_;
  std::optional<LocalTime> boots_;
  int most_waiting_ = 0;

  bool begun_ = false;           ///< sent without a request
  std::array<int, 3> origin_{};  ///< counter value at angle 0
  bool calibrate_ = false;       ///< set by the button
  bool calibrated_ = false;      ///< by command 1 since the last reset
  bool amplifiers_on_ = false;
  std::array<int, 3> current_ma_{};
  std::optional<LocalTime> told_;
  int obeyed_ = 0;
  int calibrations_ = 0;
  int said_ = 0;

  Vec3 angles_ = Vec3::Zero();
  bool switch_closed_ = false;
};

}  // namespace tendon
