// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "devices/counts.h"
#include "devices/device.h"
#include "devices/safety/guardian.h"
#include "devices/safety/safe_device.h"
#include "protocol/busy_link.h"
#include "server/assembly.h"
#include "server/guests/unknown_keys.h"
#include "server/haptic_loop.h"
#include "server/machine/announcer.h"
#include "server/machine/doorbell.h"
#include "server/machine/realtime.h"
#include "server/machine/udp_link.h"
#include "server/network_loop.h"
#include "server/scene/scene.h"

namespace tendon {

/// The threads and sockets of an Assembly. A device with a plug has a haptic thread of its own, so that none waits for
/// it; of the others all with the same period and processor share one (Assembly::HapticGroup).
///
/// | thread  | calls                         | waits for                               | may                     |
/// |---------|-------------------------------|-----------------------------------------|-------------------------|
/// | haptic… | HapticGroup::turn             | the absolute time of their next step    | nothing but compute     |
/// | network… | turn_network, of its UdpLink | a datagram, a haptic step, a timer      | allocate, log rarely    |
/// | log     | LogLoop::turn                 | 20 ms                                   | allocate, write, log    |
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

  /// Sets all forces to zero and blocks the haptic threads until `resume` is called. Waits at most 100 ms for the threads.
  /// Devices that have a safety layer must be armed again.
  void suspend();
  void resume();

  /// Zero force first; then goodbye to the guests; then the end of the recording.
  Summary stop();

  /// Whether every haptic loop has taken a step since the last call.
  bool turning();

  Address address() const { return networks_.front()->link->local_address(); }

  /// The file that it records to, which is not the scene's when that exists. Empty when it records nothing. Before
  /// `start` only.
  std::optional<std::filesystem::path> recording() const;

 private:
  /// The device of a scene, and the safety layer around it.
  struct Hardware {
    Hardware(const Scene& scene, Guardian* guardian);
    std::unique_ptr<Device> device;
    std::unique_ptr<SafeDevice> safe;  ///< null when the scene lists none
  };

  /// Serves the guests of some banks.
  struct NetworkThread {
    NetworkThread(std::size_t its_number, bool never_sleeps, std::unique_ptr<UdpLink> its_link);
    std::size_t number;  ///< of its loop in the assembly
    bool busy;           ///< it never sleeps
    std::unique_ptr<UdpLink> link;
    BusyLink busy_link{*link};  ///< used where it is busy
    Doorbell bell;              ///< a device of it has made a step
    std::thread thread{};

    UnknownKeys unknown_keys{};  ///< of its own thread
  };
  using NetworkThreads = std::vector<std::unique_ptr<NetworkThread>>;

  /// Steps devices of one period, on one processor.
  struct HapticThread {
    Assembly::HapticGroup& group;
    std::vector<Doorbell*> stepped{};  ///< of the network threads of its devices
    std::string name() const;          ///< of its first device
    std::thread thread{};
  };

  static std::vector<Hardware> hardware_of(const std::vector<Scene>& scenes, Guardian* guardian);
  static NetworkThreads network_threads_of(const std::vector<Scene>& scenes);
  std::vector<Assembly::Part> parts_of(const std::vector<Scene>& scenes);
  std::vector<Link*> links();
  std::vector<HapticThread> haptic_threads();
  /// "left: ", where there is more than one.
  std::string prefix(const Scene& scene) const;
  void end_threads();  ///< those that run: the haptic ones first, with zero force
  std::string name_of(const NetworkThread& network) const;
  void run_haptic(const HapticThread& thread);
  void stand_still(const HapticThread& thread);
  void run_network(NetworkThread& network);
  static LocalTime watch_until(NetworkThread& network, LocalTime due);
  void tell_notices(NetworkThread& network);
  void run_log();
  std::uint64_t unsent() const;
  void print_log();

  LocalTime started_;
  std::unique_ptr<Guardian> guardian_;    ///< of real devices; null when there are none
  std::vector<Hardware> hardware_;        ///< by scene
  NetworkThreads networks_;               ///< in the order of their devices
  std::unique_ptr<Announcer> announcer_;  ///< null when no scene is announced
  Assembly assembly_;
  std::vector<std::uint64_t> steps_seen_;  ///< by device, by turning()

  std::optional<Duration> run_for_;  ///< set before the threads start, as the next is
  std::mutex telling_;               ///< of network threads that have something for tell_session_
  std::function<void(const NetworkLoop::SessionChange&)> tell_session_;
  std::atomic<bool> stop_haptic_{false};
  std::atomic<bool> suspend_{false};
  std::atomic<std::size_t> suspended_{0};  ///< the number of suspended haptic threads
  std::atomic<bool> stop_network_{false};
  std::atomic<bool> stop_log_{false};
  std::optional<WakefulProcessors> wakeful_;  ///< while the threads run
  std::vector<HapticThread> haptic_threads_;
  std::thread log_thread_;
  std::thread announce_thread_;  ///< where there is an announcer
};

}  // namespace tendon
