// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace tendon::testing {

/// A D-Bus system bus with an avahi-daemon on it, both in a thread of the test, on a socket of its own. It takes the
/// calls that Tendon makes, and answers as a test wants.
///
/// Thread-safe.
class FakeAvahi {
 public:
  struct Service {
    std::uint16_t port = 0;
    std::string ip;  ///< "192.0.2.7", or one of IPv6
    std::vector<std::string> txt{};
    std::string host = "bench.local";
  };
  struct Announced {
    int interface = 0;
    int protocol = 0;
    std::string name;
    std::string type;
    std::uint16_t port = 0;
    std::vector<std::string> txt;
    bool operator==(const Announced&) const = default;
  };

  /// Listens at `socket`, which is made.
  explicit FakeAvahi(const std::filesystem::path& socket);
  ~FakeAvahi();
  FakeAvahi(const FakeAvahi&) = delete;
  FakeAvahi& operator=(const FakeAvahi&) = delete;

  /// The value of DBUS_SYSTEM_BUS_ADDRESS.
  const std::string& address() const { return address_; }

  /// On the network from now on.
  void put(const std::string& name, const Service& service);
  void take(const std::string& name);
  /// A name that another host has.
  void occupy(const std::string& name);
  /// avahi-daemon is not there: `true` answers every call with ServiceUnknown.
  void set_absent(bool absent);
  /// Calls are not answered at all.
  void set_silent(bool silent) { silent_ = silent; }
  /// avahi-daemon has been started again.
  void come_back();

  /// What is announced now, by all that are connected.
  std::vector<Announced> announced();

 private:
  struct Peer;  // keeps libsystemd out of this header
  void run();

  std::string address_;
  int listening_;
  std::mutex mutex_;  ///< of all below
  std::map<std::string, Service> services_;
  std::set<std::string> occupied_;
  bool absent_ = false;
  bool came_back_ = false;
  std::vector<std::unique_ptr<Peer>> peers_;
  std::atomic<bool> silent_{false};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace tendon::testing
