// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "devices/counts.h"
#include "devices/device.h"
#include "devices/safety/guardian.h"
#include "devices/safety/safe_device.h"
#include "protocol/busy_link.h"
#include "server/guests/health.h"
#include "server/haptic_loop.h"
#include "server/machine/announcer.h"
#include "server/machine/doorbell.h"
#include "server/machine/realtime.h"
#include "server/machine/udp_link.h"
#include "server/mailboxes.h"
#include "server/network_loop.h"
#include "server/recording/part_recorder.h"
#include "server/scene/scene.h"

namespace tendon {

/// The server: a device with its haptic loop for each scene, one network loop and one recording. A device with a plug
/// has a haptic thread of its own, so that none waits for it; of the others all with the same period and processor
/// share one, and are stepped one after the other at the same instant.
///
/// | thread  | owns                         | waits for                               | may                     |
/// |---------|------------------------------|-----------------------------------------|-------------------------|
/// | haptic… | HapticLoops, Devices         | the absolute time of their next step    | nothing but compute     |
/// | network… | NetworkLoop, UdpLink        | a datagram, a haptic step, a timer      | allocate, log rarely    |
/// | log     | PartRecorder                  | 20 ms                                   | allocate, write, log    |
/// | announce| Announcer, if a scene has one | D-Bus                                   | allocate, log           |
///
/// They share the Mailboxes of each device, and nothing else. A large server has several network threads, which share
/// its devices by whole banks (Shard).
class Server {
 public:
  struct DeviceSummary {
    std::string name;
    HapticLoop::Stats haptic;
    std::optional<SafeDevice::Status> safety;  ///< empty: its scene lists no safety layer
    std::optional<DeviceCounts> counts;        ///< of its driver; empty: a device without a plug
  };
  struct Summary {
    std::vector<DeviceSummary> devices;
    NetworkLoop::Stats network;
    std::optional<PartRecorder::Status> recording;  ///< empty when the scene records nothing
    Duration uptime{};
  };

  /// Binds the port, opens the recording, makes the device. Throws what these throw: sentences for the operator.
  /// Network and recording are those of the first scene.
  explicit Server(const std::vector<Scene>& scenes);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Starts the threads. Throws std::runtime_error, a sentence for the operator, when the system refuses one; those
  /// that had begun have ended then. With `run_for` each haptic thread ends by itself, with zero force, so long after
  /// its first step: it takes run_for / period steps, or fewer when some came too late.
  void start(std::optional<Duration> run_for = std::nullopt);

  /// Called by a network thread for each guest that comes or goes, those that the end of the server sends away too; by
  /// one at a time. Before `start` only. It may block no longer than a line of the log does.
  void tell_sessions(std::function<void(const NetworkLoop::SessionChange&)> tell) { tell_session_ = std::move(tell); }

  /// Zero force first; then goodbye to the guests; then the end of the recording.
  Summary stop();

  /// Whether every haptic loop has taken a step since the last call.
  bool turning();

  Address address() const { return networks_.front()->link->local_address(); }

  /// The file that it records to, which is not the scene's when that exists. Empty when it records nothing. Before
  /// `start` only.
  std::optional<std::filesystem::path> recording() const;

 private:
  /// A device and what it needs to itself.
  struct DeviceRuntime {
    DeviceRuntime(const Scene& scene, const Mailboxes::Capacities& capacities, Guardian* guardian);
    Scene scene;
    std::unique_ptr<Device> device;
    std::unique_ptr<SafeDevice> safe;  ///< around it; null when the scene lists none
    Mailboxes mail;
    HapticLoop haptic;
    std::atomic<bool> not_realtime{false};  ///< the kernel refused its haptic thread something
    std::uint64_t steps_seen = 0;           ///< by turning()

    // What run_log has told the operator already.
    HapticLoop::Stats told;
    SafeDevice::Status told_safety;
    DeviceCounts told_counts;
    std::uint64_t told_steps_lost = 0;
    std::uint64_t told_ports_lost = 0;
    std::array<PortPhase, limits::kMaxChannels> told_phase;  ///< by channel
  };
  using DeviceRuntimes = std::vector<std::unique_ptr<DeviceRuntime>>;

  /// Serves the guests of some banks.
  struct NetworkThread {
    NetworkThread(const NetworkLoop::Config& config, bool never_sleeps, std::unique_ptr<UdpLink> its_link,
                  const std::vector<Mailboxes*>& mail);
    std::size_t first_device;
    Mailboxes& recorded;  ///< that of its first device, for the datagrams that are recorded
    bool busy;            ///< it never sleeps
    std::unique_ptr<UdpLink> link;
    BusyLink busy_link{*link};         ///< used where it is busy
    Doorbell bell;                     ///< a device of it has made a step
    SpscRing<HandedHello> hellos{16};  ///< from the first network thread
    NetworkLoop loop;
    std::thread thread{};

    // What run_log has told the operator already.
    std::uint64_t told_datagrams_lost = 0;
    std::uint64_t told_strangers = 0;
    std::uint64_t told_over_budget = 0;
  };
  using NetworkThreads = std::vector<std::unique_ptr<NetworkThread>>;

  /// Steps devices of one period, on one processor.
  struct HapticThread {
    std::vector<DeviceRuntime*> devices;
    std::vector<Doorbell*> stepped{};  ///< of the network threads of its devices
    std::string name() const;          ///< of its first device
    std::thread thread{};
  };

  static DeviceRuntimes runtimes_of(const std::vector<Scene>& scenes, Guardian* guardian);
  static NetworkThreads network_threads_of(const std::vector<Scene>& scenes, const DeviceRuntimes& devices);
  static std::vector<HapticThread> haptic_threads_of(const DeviceRuntimes& devices, const NetworkThreads& networks);
  static NetworkLoop::Config network_config(const DeviceRuntimes& devices);
  /// "left: ", where there is more than one.
  std::string prefix(const DeviceRuntime& runtime) const;
  void end_threads();  ///< those that run: the haptic ones first, with zero force
  std::string name_of(const NetworkThread& network) const;
  void run_haptic(const HapticThread& thread);
  void run_network(NetworkThread& network);
  static LocalTime watch_until(NetworkThread& network, LocalTime due);
  static void take_hellos(LocalTime now, NetworkThread& network);
  void hand_on_hellos(NetworkThread& network);
  void tell_notices(NetworkThread& network);
  void run_log();
  void drain_to_recorder(LocalTime now);
  void record_left_out(LocalTime now);
  void tell_of_recording();
  void report_health(LocalTime now, DeviceRuntime& runtime);
  void report_counts(DeviceRuntime& runtime);
  void report_phase(DeviceRuntime& runtime, const PortRecord& port);
  void report_overruns(const HapticThread& thread) const;
  void report_trouble(DeviceRuntime& runtime);
  void report_safety(DeviceRuntime& runtime);
  void save_flight(DeviceRuntime& runtime);

  LocalTime started_;
  std::unique_ptr<Guardian> guardian_;  ///< of real devices; null when there are none
  DeviceRuntimes devices_;
  NetworkThreads networks_;                 ///< in the order of their devices
  std::unique_ptr<Announcer> announcer_;    ///< null when no scene is announced
  std::unique_ptr<PartRecorder> recorder_;  ///< null when the scene records nothing

  bool recording_stopped_ = false;
  LocalTime tell_next_{};

  std::optional<Duration> run_for_;  ///< set before the threads start, as the next is
  std::mutex telling_;               ///< of network threads that have something for tell_session_
  std::function<void(const NetworkLoop::SessionChange&)> tell_session_;
  std::atomic<bool> stop_haptic_{false};
  std::atomic<bool> stop_network_{false};
  std::atomic<bool> stop_log_{false};
  std::optional<WakefulProcessors> wakeful_;  ///< while the threads run
  std::vector<HapticThread> haptic_threads_;
  std::thread log_thread_;
  std::thread announce_thread_;  ///< where there is an announcer
};

}  // namespace tendon
