// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "devices/device.h"
#include "server/byte_sink.h"
#include "server/doorbell.h"
#include "server/haptic_loop.h"
#include "server/mailboxes.h"
#include "server/network_loop.h"
#include "server/recorder.h"
#include "server/scene.h"
#include "server/udp_link.h"

namespace tendon {

/// The server: one scene's device, its two loops and its recording, each on a thread of its own.
///
/// | thread  | owns                         | waits for                               | may                     |
/// |---------|------------------------------|-----------------------------------------|-------------------------|
/// | haptic  | HapticLoop, Device           | the absolute time of its next step      | nothing but compute     |
/// | network | NetworkLoop, UdpLink         | a datagram, a haptic step, a timer      | allocate, log rarely    |
/// | log     | Recorder                     | 20 ms                                   | allocate, write, log    |
///
/// They share the Mailboxes, and nothing else.
class Server {
 public:
  struct Summary {
    HapticLoop::Stats haptic;
    NetworkLoop::Stats network;
    std::optional<Recorder::Status> recording;  ///< empty when the scene records nothing
    Duration uptime{};
  };

  /// Binds the port, opens the recording, makes the device. Throws what these throw: sentences for the operator.
  explicit Server(const Scene& scene);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  void start();

  /// Zero force first; then goodbye to the guests; then the end of the recording.
  Summary stop();

  Address address() const { return link_.local_address(); }

 private:
  void run_haptic();
  void run_network();
  void run_log();
  void drain_to_recorder(LocalTime now);
  void report_trouble();
  void save_flight();
  Recorder::Config recorder_config() const;

  Scene scene_;
  LocalTime started_;
  std::unique_ptr<Device> device_;
  std::unique_ptr<Mailboxes> mail_;
  UdpLink link_;
  Doorbell stepped_;
  HapticLoop haptic_;
  NetworkLoop network_;
  std::unique_ptr<FileSink> sink_;
  std::unique_ptr<Recorder> recorder_;

  // What run_log has told the operator already.
  HapticLoop::Stats told_;
  std::uint64_t told_steps_lost_ = 0;
  std::uint64_t told_datagrams_lost_ = 0;
  bool told_recording_ended_ = false;
  LocalTime tell_next_{};
  int flights_ = 0;

  std::atomic<bool> stop_haptic_{false};
  std::atomic<bool> stop_network_{false};
  std::atomic<bool> stop_log_{false};
  std::thread haptic_thread_;
  std::thread network_thread_;
  std::thread log_thread_;
};

}  // namespace tendon
