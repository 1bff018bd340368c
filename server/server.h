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
#include "server/clients/unknown_keys.h"
#include "server/haptic_loop.h"
#include "server/machine/announcer.h"
#include "server/machine/doorbell.h"
#include "server/machine/realtime.h"
#include "server/machine/udp_link.h"
#include "server/network_loop.h"
#include "server/scene/scene.h"

namespace tendon {

/// The threads (server/THREADS.md) and sockets of an Assembly. They only share the Mailboxes of each device.
class Server {
 public:
  struct DeviceSummary {
    std::string name;
    HapticLoop::Stats haptic;
    std::optional<SafeDevice::Status> safety;  ///< empty if the scene has no safety layer
    std::optional<DeviceCounts> counts;        ///< empty if it is not a USB device
  };
  struct Summary {
    std::vector<DeviceSummary> devices;
    NetworkLoop::Stats network;
    std::optional<PartRecorder::Status> recording;  ///< empty if nothing is recorded
    Duration uptime{};
  };

  /// Binds the port, opens the recording and creates the devices. The first scene determines the network and the
  /// recording. Throws exceptions with messages for the operator.
  explicit Server(const std::vector<Scene>& scenes);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Starts the threads. If the system refuses one, stops the others and throws std::runtime_error with a message for
  /// the operator. If `run_for` is set, each haptic thread ends after this time and sets the force to zero. This is
  /// after run_for / period steps, or fewer if there were delays.
  void start(std::optional<Duration> run_for = std::nullopt);

  /// Sets the function that is called if a session is opened or closed, even by stop(). The network threads call it,
  /// but never concurrently. It should not block. Must be called before `start`.
  void on_sessions(std::function<void(const NetworkLoop::SessionChange&)> tell) { on_session_ = std::move(tell); }

  /// Sets all forces to zero, disarms safety layers and blocks the haptic threads until `resume`. Takes at most 100 ms.
  void suspend();
  void resume();

  Summary stop();  ///< sets the forces to zero, then closes the sessions, then the recording

  bool turning();  ///< true if every haptic loop has made a step since the last call

  Address address() const { return networks_.front()->link->local_address(); }

  /// The path of the recording, if any. It differs from the scene's if that file exists. To be called before `start`.
  std::optional<std::filesystem::path> recording() const;

 private:
  struct Hardware {
    Hardware(const Scene& scene, Guardian* guardian);
    std::unique_ptr<Device> device;
    std::unique_ptr<SafeDevice> safe;
  };

  /// Serves the clients of some banks.
  struct NetworkThread {
    NetworkThread(std::size_t its_number, bool never_sleeps, std::unique_ptr<UdpLink> its_link);
    std::size_t number;  ///< index of its loop in assembly_
    bool busy;           ///< polls instead of sleeping
    std::unique_ptr<UdpLink> link;
    BusyLink busy_link{*link};
    Doorbell bell;  ///< rung by the haptic threads of its devices
    std::thread thread{};

    UnknownKeys unknown_keys{};
  };
  using NetworkThreads = std::vector<std::unique_ptr<NetworkThread>>;

  /// Steps devices with the same period and processor.
  struct HapticThread {
    Assembly::HapticGroup& group;
    std::vector<Doorbell*> stepped{};  ///< bells of the network threads of its devices
    std::string name() const;          ///< after its first device
    std::thread thread{};
  };

  static std::vector<Hardware> hardware_of(const std::vector<Scene>& scenes, Guardian* guardian);
  static NetworkThreads network_threads_of(const std::vector<Scene>& scenes);
  std::vector<Assembly::Part> parts_of(const std::vector<Scene>& scenes);
  std::vector<Link*> links();
  std::vector<HapticThread> haptic_threads();
  std::string prefix(const Scene& scene) const;
  void end_threads();  ///< the haptic threads first, which set the forces to zero
  std::string name_of(const NetworkThread& network) const;
  void run_haptic(const HapticThread& thread);
  void stand_still(const HapticThread& thread);
  void run_network(NetworkThread& network);
  static LocalTime watch_until(NetworkThread& network, LocalTime due);
  void publish_notices(NetworkThread& network);
  void run_log();
  std::uint64_t unsent() const;
  void print_log();

  LocalTime started_;
  std::unique_ptr<Guardian> guardian_;  ///< null if there is no real device with motors
  std::vector<Hardware> hardware_;
  NetworkThreads networks_;               ///< in the order of their devices
  std::unique_ptr<Announcer> announcer_;  ///< null if no scene is announced
  Assembly assembly_;
  std::vector<std::uint64_t> steps_seen_;  ///< by device, at the last call of turning()

  std::optional<Duration> run_for_;
  std::mutex publishing_;  ///< serializes calls of on_session_
  std::function<void(const NetworkLoop::SessionChange&)> on_session_;
  std::atomic<bool> stop_haptic_{false};
  std::atomic<bool> suspend_{false};
  std::atomic<std::size_t> suspended_{0};
  std::atomic<bool> stop_network_{false};
  std::atomic<bool> stop_log_{false};
  std::optional<WakefulProcessors> wakeful_;
  std::vector<HapticThread> haptic_threads_;
  std::thread log_thread_;
  std::thread announce_thread_;
};

}  // namespace tendon
