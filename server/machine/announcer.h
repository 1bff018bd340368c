// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocol/discovery.h"
#include "protocol/link.h"

namespace tendon {

/// Announces devices on the local network by DNS-SD (protocol/discovery.h), through avahi-daemon over D-Bus. If D-Bus
/// or avahi-daemon is not available, this is reported once, and the requests are sent again when it becomes available.
/// If a name is already used by another host, "#2" is appended. If the server listens on 0.0.0.0 or [::], the devices
/// are announced on all interfaces, and otherwise on the interface with the listen address.
///
/// run() should be called in a separate thread. The announcements are removed when it returns, and also if the process
/// is killed, because Avahi monitors the connection. Realtime-safe: no.
class Announcer {
 public:
  struct Device {
    std::string name;  ///< see dns_sd::is_instance_name()
    dns_sd::About about;
  };
  /// Receives messages for the operator from the thread of run().
  using Say = std::function<void(bool warning, const std::string& sentence)>;

  /// `listen` is the address of the server with the actual port. Throws std::runtime_error ("[discovery] announce: …")
  /// if this is a loopback address, or if an event loop cannot be created.
  Announcer(std::vector<Device> devices, const Address& listen, Say say);
  ~Announcer();
  Announcer(const Announcer&) = delete;
  Announcer& operator=(const Announcer&) = delete;

  void run();
  /// Thread-safe: yes. If stop() is called first, run() returns immediately.
  void stop() noexcept;

 private:
  class Avahi;
  std::unique_ptr<Avahi> avahi_;
};

}  // namespace tendon
