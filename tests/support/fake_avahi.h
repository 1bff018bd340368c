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

/// A D-Bus system bus with a fake avahi-daemon, in its own thread and on its own socket. The test chooses the answers
/// to Tendon's calls. Thread-safe: yes.
class FakeAvahi {
 public:
  struct Service {
    std::uint16_t port = 0;
    std::string ip;  ///< "192.0.2.7", or an IPv6 address
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

  explicit FakeAvahi(const std::filesystem::path& socket);
  ~FakeAvahi();
  FakeAvahi(const FakeAvahi&) = delete;
  FakeAvahi& operator=(const FakeAvahi&) = delete;

  const std::string& address() const { return address_; }

  void put(const std::string& name, const Service& service);
  void take(const std::string& name);
  void occupy(const std::string& name);
  /// While `absent`, avahi-daemon is not running: every call fails with ServiceUnknown.
  void set_absent(bool absent);
  void set_silent(bool silent) { silent_ = silent; }
  void come_back();

  std::vector<Announced> announced();

 private:
  struct Peer;  // defined in the source file to avoid including libsystemd
  void run();

  std::string address_;
  int listening_;
  std::mutex mutex_;  ///< protects the members below
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
