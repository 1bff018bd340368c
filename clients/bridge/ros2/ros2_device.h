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

#include "clients/bridge/bridged_device.h"
#include "clients/bridge/ros2/crtk.h"
#include "clients/bridge/ros2/ros2_messages.h"
#include "clients/bridge/ros2/ros2_servo.h"

namespace tendon::bridge {

/// The newest force of a program is valid for three times the median of its last 8 intervals, within 20 … 200 ms. It is
/// valid for 200 ms until three intervals are known. For a program at 1 kHz this is 20 ms, at 20 Hz 150 ms.
class Freshness {
 public:
  void came(LocalTime now);
  Duration good_for() const;

 private:
  static constexpr std::size_t kGaps = 8;
  std::array<Duration, kGaps> gaps_{};
  std::size_t count_ = 0;
  std::optional<LocalTime> newest_;
};

/// The ROS 2 interface of one device without DDS: determines which messages are due and handles received messages.
///
/// * Each new state results in pose, twist, wrench and joint state messages and, with the clutch, a servo message; at
///   most Config::rate_hz per second. Joy is published immediately when a button changes, otherwise at 50 Hz.
/// * Commands of programs other than the owner are dropped. Each command is sent once with the validity
///   Freshness::good_for(). Torques are forwarded if the device has actuators for them.
/// * `servo_cf` of CRTK is always the force on the hand, even if Config::negate is set. `servo_cp` is refused.
/// * At most 16 publishers can send forces. The commands of other publishers are dropped.
///
/// Thread-safe: no. Realtime-safe: no.
class RosDevice {
 public:
  struct Config {
    std::string name;    ///< see ros_name()
    double rate_hz = 0;  ///< 0: publish every state
    bool negate = false;
    std::optional<RosServo> servo{};
    std::string clutch{};          ///< name or number of the clutch button for the servo messages
    bool crtk = false;             ///< with the messages of CRTK
    bool negate_measured = false;  ///< `measured_cf` is the force of the hand on the device
  };
  static constexpr std::size_t kMostPrograms = 16;

  /// `bridged` must outlive this object.
  RosDevice(BridgedDevice& bridged, Config config) : bridged_(bridged), config_(std::move(config)) {
    if (config_.crtk) crtk_.emplace(bridged);
  }

  struct Messages {
    std::optional<RosPose> pose{};
    std::optional<RosTwist> twist{};
    std::optional<RosWrench> wrench{};
    std::optional<RosJointState> joints{};
    std::optional<RosJoy> joy{};
    RosServo::Output servo{};
    std::optional<RosWrench> measured_cf{};  ///< CRTK; `measured_cp` and `measured_cv` are the pose and the twist
    std::optional<RosOperatingState> operating_state{};
  };
  /// Must be called after each turn of the BridgedDevice. `since_1970` is the system time at LocalTime 0.
  Messages messages(LocalTime now, Duration since_1970);

  void take(const RosInput& input, LocalTime now);    ///< handles the message of a program
  void keep(std::span<const std::uint64_t> writers);  ///< releases the device from all but these publishers

  RosDiagnosis diagnosis();  ///< status for /diagnostics since the previous call

  std::uint64_t refused() const noexcept { return refused_; }  ///< commands with an invalid frame, value or program

  std::optional<std::string> next_sentence();  ///< message about a change; empty: none

 private:
  struct Program {
    BridgedDevice::Program number = 0;
    std::string called;
    RosInput::Topic topic = RosInput::Topic::kWrenchCommand;
    Freshness freshness{};
    std::string said{};
    LocalTime said_at{};
  };

  bool is_due(LocalTime now);
  bool joy_is_due(LocalTime now);
  void learn();
  bool clutch_held() const;
  Program* program_of(const RosInput& input);
  void take_wrench(Program& program, const RosInput& input, LocalTime now);
  void say_of(Program& program, const std::string& sentence, LocalTime now);
  void drop(Program& program, const std::string& why, LocalTime now);
  void say(std::string sentence);

  BridgedDevice& bridged_;
  Config config_;
  std::uint64_t states_ = 0;
  LocalTime next_{};
  LocalTime next_joy_{};
  std::uint32_t buttons_ = 0;
  bool knows_ = false;  ///< the handle of the current session is known
  std::optional<std::size_t> clutch_;
  std::optional<CrtkState> crtk_;
  std::map<std::uint64_t, Program> programs_;
  BridgedDevice::Program numbers_ = 0;
  std::uint64_t refused_ = 0;
  std::string refusal_;  ///< since the last diagnosis
  std::uint64_t states_told_ = 0;
  std::uint64_t forces_told_ = 0;
  std::deque<std::string> sentences_;
};

}  // namespace tendon::bridge
