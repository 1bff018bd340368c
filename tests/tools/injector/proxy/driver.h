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

/// The real network around a Proxy: sockets, the clock, and one thread that does nothing but take datagrams and release
/// them when they are due. It never prints, opens no file, builds no tables and waits for no lock.
class Driver {
 public:
  struct Config {
    Address listen;
    /// The addresses of the server, in order of preference. They are tried in turn, for half a second each, until the
    /// server answers.
    std::vector<Address> servers;
    Proxy::Config proxy;

    /// Awake for this long before each release instead of asleep: exact, at the price of the processor. Zero: asleep.
    Duration spin{};

    /// Priority 1…99 of SCHED_FIFO for the thread that runs.
    std::optional<int> realtime = {};

    /// Ends the run; none: until stop().
    std::optional<Duration> duration = {};
  };

  /// Opens the sockets. Throws std::runtime_error as UdpBatch does, std::invalid_argument as Proxy does. `recorder`,
  /// when there is one, must outlive the driver and gets every decision.
  Driver(const Config& config, TraceRecorder* recorder);
  ~Driver();
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;

  /// Takes and releases datagrams until the duration is over or stop() is called. Throws std::system_error when the
  /// system refuses what it needs: a priority, a descriptor.
  void run();

  // From any other thread, while run() runs, before or after it:

  /// Async-signal-safe, too.
  void stop() noexcept;
  /// Another network from now on.
  void change(Proxy::PreparedChange change);
  /// As it was at most 0.2 s ago; complete when run() has returned.
  Status status() const;

  /// Where clients send to; the port is the real one.
  Address local_address() const { return listener_.local_address(); }

 private:
  struct Upstream {
    UdpBatch socket;
    std::uint32_t rebinds = 0;
    Address asked_at{};  ///< the local address that the client uses, if the listener is bound to all addresses
  };
  /// Why the timer is set.
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
  std::uint64_t closed_overflowed_ = 0;  // of upstream sockets that are no more
  std::size_t server_ = 0;               // in use, of config_.servers
  std::uint64_t asked_before_ = 0;       // the number of datagrams sent to the server at the last change of the address
  LocalTime next_server_{};              // the time of the next change, if there is no answer
  std::string no_socket_;                // the first error from the system
  std::uint64_t late_rebinds_ = 0;
  int epoll_ = -1;
  int timer_ = -1;
  int bell_ = -1;  // rung by stop() and change()

  LocalTime start_{};
  LocalTime end_ = LocalTime::max();
  LocalTime next_publish_{};
  std::vector<Proxy::Departure> due_;
  std::vector<TraceRecord> records_;

  DurationHistogram timer_floor_;
  LocalTime next_probe_{};                              // not before
  std::optional<LocalTime> probe_;                      // when the timer is to wake us for nothing
  Duration last_sleep_ = std::chrono::milliseconds(1);  // before the last release

  std::atomic<bool> stop_ = false;
  mutable std::mutex mutex_;  // of what follows
  std::vector<Proxy::PreparedChange> changes_;
  Status status_;
};

}  // namespace tendon::injector
