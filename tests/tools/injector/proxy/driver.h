// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <bitset>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"
#include "tests/tools/injector/proxy/proxy.h"
#include "tests/tools/injector/proxy/status.h"
#include "tests/tools/injector/proxy/udp_batch.h"
#include "tests/tools/injector/traces/trace_recorder.h"

namespace tendon::injector {

/// Connects a Proxy to sockets and the clock. The thread of run() receives the datagrams and sends them at their
/// release time. It does not print, open files, build tables or wait for a lock.
class Driver {
 public:
  struct Config {
    Address listen;
    /// The server's addresses, each tried for half a second in turn until it answers.
    std::vector<Address> servers;
    Proxy::Config proxy;

    /// The time of the busy-wait before each release. If it is zero, the thread sleeps, which is less exact.
    Duration spin{};

    /// Priority 1…99 of SCHED_FIFO for the thread that calls run().
    std::optional<int> realtime = {};

    /// None: until stop().
    std::optional<Duration> duration = {};
  };

  /// Throws std::runtime_error as UdpBatch does and std::invalid_argument as Proxy does. `recorder` receives all
  /// decisions and must outlive the driver. It can be null.
  Driver(const Config& config, TraceRecorder* recorder);
  ~Driver();
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;

  /// Receives and releases datagrams until the duration has elapsed, the trace has ended or stop() is called. Throws
  /// std::system_error if the system refuses a priority or a descriptor.
  void run();

  // Other threads can call the following functions at any time.

  /// Async-signal-safe.
  void stop() noexcept;
  void change(Proxy::PreparedChange change);
  /// Returns the status, which is updated every 0.2 s and when run() returns.
  Status status() const;

  /// The address for clients, with the actual port.
  Address local_address() const { return listener_.local_address(); }

 private:
  struct Upstream {
    UdpBatch socket;
    std::uint32_t rebinds = 0;
    Address asked_at{};  ///< the local address to which the client sends, if the listener is bound to all addresses
  };
  enum class Wake : std::uint8_t { kOther, kRelease, kProbe };

  void wait(LocalTime now);
  void receive(std::uint64_t source);
  void take_from_client(const UdpBatch::Arrival& arrival);
  void seek_server(LocalTime now);
  LocalTime send_due(LocalTime now);
  std::bitset<kUdpBatch> send_with(std::size_t first, const std::bitset<kUdpBatch>& sent);
  UdpBatch& socket_for(const Proxy::Departure& departure);
  Address asked_at(const Proxy::Departure& departure) const;
  std::optional<UdpBatch> new_socket();
  void replace_socket(ClientIndex client, Upstream& upstream, UdpBatch socket);
  void watch(int fd, std::uint64_t source, std::uint32_t events) const;
  void take_changes(LocalTime now);
  bool publish(LocalTime now);
  Status measure(LocalTime now) const;

  Config config_;
  Proxy proxy_;
  TraceRecorder* recorder_;
  UdpBatch listener_;
  UdpBatch::Inbox inbox_;
  std::unordered_map<ClientIndex, Upstream> upstreams_;
  std::uint64_t closed_overflowed_ = 0;  // by upstream sockets that have been closed
  std::size_t server_ = 0;               // index in config_.servers
  std::uint64_t asked_before_ = 0;       // datagrams sent to the server when the address last changed
  LocalTime next_server_{};
  std::string no_socket_;
  std::uint64_t late_rebinds_ = 0;
  int epoll_ = -1;
  int timer_ = -1;
  int bell_ = -1;  // eventfd, signaled by stop() and change()

  LocalTime start_{};
  LocalTime end_ = LocalTime::max();
  LocalTime next_publish_{};
  std::vector<Proxy::Departure> due_;
  std::vector<TraceRecord> records_;

  DurationHistogram timer_floor_;
  LocalTime next_probe_{};
  std::optional<LocalTime> probe_;                      // the time of the next measurement of the timer latency
  Duration last_sleep_ = std::chrono::milliseconds(1);  // before the last release

  std::atomic<bool> stop_ = false;
  mutable std::mutex mutex_;  // protects the members below
  std::vector<Proxy::PreparedChange> changes_;
  Status status_;
};

}  // namespace tendon::injector
