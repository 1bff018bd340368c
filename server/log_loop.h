// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "devices/counts.h"
#include "devices/safety/safe_device.h"
#include "server/haptic_loop.h"
#include "server/mailboxes.h"
#include "server/recording/part_recorder.h"
#include "server/scene/scene.h"
#include "server/trouble_sum.h"

namespace tendon {

/// Records the steps, ports and datagrams from the mailboxes, passes the health of each device to the network loops
/// (Mailboxes::health), and collects messages for the log. One thread calls `turn` every kPeriod while the other loops
/// run, and `close` after they have ended. Thread-safe: no. Realtime-safe: no.
class LogLoop {
 public:
  static constexpr Duration kPeriod = std::chrono::milliseconds(20);
  static constexpr Duration kTroublePeriod = std::chrono::seconds(1);  ///< between reports of the same problem

  /// The references must outlive the LogLoop.
  struct Watched {
    const Scene& scene;
    const Device& device;
    const SafeDevice* safe;  ///< null if there is no safety layer
    const HapticLoop& haptic;
    Mailboxes& mail;
    const std::atomic<bool>& not_realtime;  ///< true if the haptic thread did not get its priority
    std::size_t thread = 0;
  };

  struct Notice {
    enum class Level { kInfo, kWarning, kError };
    Level level = Level::kInfo;
    std::string text;
  };

  /// kTaken removes the steps, ports, datagrams and flights from the mailboxes and records them. kLeft leaves them.
  enum class Records : std::uint8_t { kTaken, kLeft };

  /// The first scene configures the recording. `recorded` lists the mailboxes with the datagrams of each network loop.
  /// Throws the errors of PartRecorder.
  LogLoop(const std::vector<Watched>& devices, const std::vector<Mailboxes*>& recorded, LocalTime started,
          Records records = Records::kTaken);

  /// `unsent` counts the datagrams that the system has refused to send. Returns the time of the next call.
  LocalTime turn(LocalTime now, std::uint64_t unsent);

  void close(LocalTime now, std::uint64_t unsent);

  std::vector<Notice> take_notices();  ///< since the last call, in order

  std::optional<PartRecorder::Status> recording() const;  ///< empty if nothing is recorded

 private:
  struct Reported {
    HapticLoop::Stats haptic{};
    SafeDevice::Status safety{};
    DeviceCounts counts{};
    std::uint64_t steps_lost = 0;
    std::uint64_t ports_lost = 0;
    std::uint64_t inputs_lost = 0;
    std::uint64_t field_data_lost = 0;
    std::array<PortPhase, limits::kMaxChannels> phase{};
  };
  struct DeviceLog {
    Watched of;
    Reported reported{};
  };
  struct NetworkLog {
    Mailboxes* mail;
    std::uint64_t datagrams_lost = 0;
    std::uint64_t unauthenticated = 0;
    std::uint64_t over_budget = 0;
  };
  struct ThreadLog {
    std::vector<const DeviceLog*> devices{};
    TroubleSum overruns{};
  };

  void round(LocalTime now, std::uint64_t unsent, bool last);
  void say(Notice::Level level, const DeviceLog& device, const std::string& text);
  void say(Notice::Level level, std::string text) { notices_.push_back({level, std::move(text)}); }
  void record_fields(std::size_t number, std::uint64_t until);
  std::uint64_t record_steps(std::size_t number);
  void record_all(LocalTime now);
  void record_left_out(LocalTime now);
  void take_notices_of_recorder();
  void report_health(LocalTime now, std::uint64_t unsent, DeviceLog& device);
  void report_overruns(LocalTime now, ThreadLog& thread);
  void report_trouble(DeviceLog& device);
  void report_safety(DeviceLog& device);
  void report_counts(DeviceLog& device);
  void report_phase(DeviceLog& device, const PortRecord& port);
  void save_flight(DeviceLog& device);

  LocalTime started_;
  LocalTime trouble_due_;
  bool takes_records_;
  std::vector<DeviceLog> devices_;
  std::vector<ThreadLog> threads_;
  std::vector<NetworkLog> networks_;
  std::unique_ptr<PartRecorder> recorder_;
  bool recording_ended_ = false;
  std::vector<Notice> notices_;
};

}  // namespace tendon
