// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "clients/plug/plug.h"
#include "clients/plug/ros2/ros2_messages.h"
#include "clients/plug/ros2/ros2_servo.h"

namespace tendon::plug {

/// How long a program's newest force is good for: three times the median of its last 8 gaps, 20 … 200 ms; 200 ms until
/// three gaps are known. A program at 1 kHz is let go after 20 ms, one at 20 Hz after 150 ms.
class Freshness {
 public:
  void came(LocalTime now);
  Duration good_for() const;

 private:
  static constexpr std::size_t kGaps = 8;
  std::array<Duration, kGaps> gaps_{};
  std::size_t count_ = 0;  ///< of gaps, ever
  std::optional<LocalTime> newest_;
};

/// What one device is for ROS 2's programs, without DDS: which messages are due, and what becomes of their
/// `wrench_command`s.
///
/// * Each new state is pose, twist, wrench, joint states and, with the clutch, a servo message; at most Config::rate_hz
///   a second. Joy goes out at once when a button changes, else 50/s.
/// * A command is the owner's, or it is dropped. It is sent once, and the server is told how long it is good:
///   Freshness::good_for(). A torque is sent on when the device has motors for it.
/// * At most 16 programs publish commands: the commands of another one are dropped.
///
/// Thread-safe: no. Realtime-safe: no.
class RosDevice {
 public:
  struct Config {
    std::string name;    ///< see ros_name()
    double rate_hz = 0;  ///< 0: every state
    bool negate = false;
    std::optional<RosServo> servo{};
    std::string clutch{};  ///< name or number of the button that is the servo's clutch
  };
  static constexpr std::size_t kMostPrograms = 16;

  /// `plug` must outlive this object.
  RosDevice(Plug& plug, Config config) : plug_(plug), config_(std::move(config)) {}

  /// What is due now.
  struct Messages {
    std::optional<RosPose> pose{};
    std::optional<RosTwist> twist{};
    std::optional<RosWrench> wrench{};
    std::optional<RosJointState> joints{};
    std::optional<RosJoy> joy{};
    RosServo::Output servo{};
  };
  /// To be called after each turn of the plug. `since_1970` is that time at LocalTime 0, by the system's clock.
  Messages messages(LocalTime now, Duration since_1970);

  /// A `wrench_command` of the program that DDS knows by the number `writer` and people by `called`.
  void take(std::uint64_t writer, std::string_view called, const RosWrench& command, LocalTime now);
  /// Only these publish commands now: what others asked for is let go.
  void keep(std::span<const std::uint64_t> writers);

  /// How it stands, for /diagnostics; of the time since it was asked last.
  RosDiagnosis diagnosis();

  std::uint64_t refused() const noexcept { return refused_; }  ///< commands: frame, not finite, too many programs

  /// Each change in a sentence, once. Empty: nothing new.
  std::optional<std::string> next_sentence();

 private:
  struct Program {
    Plug::Program number = 0;
    std::string called;
    Freshness freshness{};
    std::string said{};  ///< the newest sentence about it
    LocalTime said_at{};
  };

  bool is_due(LocalTime now);
  bool joy_is_due(LocalTime now);
  void learn();
  bool clutch_held() const;
  Program* program_of(std::uint64_t writer, std::string_view called);
  void drop(Program& program, const std::string& why, LocalTime now);
  void say(std::string sentence);

  Plug& plug_;
  Config config_;
  std::uint64_t states_ = 0;  ///< seen
  LocalTime next_{};
  LocalTime next_joy_{};
  std::uint32_t buttons_ = 0;
  bool knows_ = false;  ///< the handle of the present session
  std::optional<std::size_t> clutch_;
  std::map<std::uint64_t, Program> programs_;
  Plug::Program numbers_ = 0;
  std::uint64_t refused_ = 0;
  std::string refusal_;  ///< since the last diagnosis
  std::uint64_t states_told_ = 0;
  std::uint64_t forces_told_ = 0;
  std::deque<std::string> sentences_;
};

}  // namespace tendon::plug
