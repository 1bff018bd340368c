// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocol/discovery.h"
#include "protocol/link.h"

namespace tendon {

/// Announces devices on the local network by DNS-SD (protocol/discovery.h): it asks avahi-daemon, over D-Bus, and goes
/// on asking. Where there is no D-Bus or no avahi-daemon it says so once, and tries again when one may be there. A name
/// that another host has becomes "NAME #2". Only the interface of the address that the server listens on is told, all
/// of them for 0.0.0.0 and [::].
///
/// run() is for a thread of its own; nothing else of the server waits for it. What is announced is gone when run() has
/// returned, and also when the process is killed: Avahi sees the connection end.
///
/// Realtime-safe: no.
class Announcer {
 public:
  struct Device {
    std::string name;  ///< dns_sd::is_instance_name()
    dns_sd::About about;
  };
  /// One sentence for the operator, from the thread of run().
  using Say = std::function<void(bool warning, const std::string& sentence)>;

  /// `listen` is where the server can be reached, with its real port. Throws std::runtime_error when that is this
  /// machine alone ("[discovery] announce: …"), or when the system gives no event loop.
  Announcer(std::vector<Device> devices, const Address& listen, Say say);
  ~Announcer();
  Announcer(const Announcer&) = delete;
  Announcer& operator=(const Announcer&) = delete;

  /// Announces until stop().
  void run();
  /// Thread-safe; also before run(), which then returns at once.
  void stop() noexcept;

 private:
  class Avahi;  // keeps libsystemd out of this header
  std::unique_ptr<Avahi> avahi_;
};

}  // namespace tendon
