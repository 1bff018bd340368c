// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "clients/c/tendon.h"
#include "clients/cpp/force_client.h"
#include "clients/cpp/server_name.h"
#include "clients/cpp/udp_transport.h"
#include "protocol/busy_link.h"

namespace tendon {

/// Combines a ForceClient with a socket, and replaces its callback by the functions wait() and send(). All functions that
/// return an int return a result of tendon.h, and serve the session while they wait. Negative timeouts do not end.
///
/// Thread-safe: no. Realtime-safe: no, but wait() and send() do not use the heap while a session is open, except for
/// the texts of LinkReport.
class PullClient {
 public:
  struct Config {
    ServerName server;
    ForceClient::Config client{};  ///< `seed` is replaced
    bool observe = false;
    bool poll = false;
  };

  explicit PullClient(const Config& config);  ///< throws as UdpTransport and ForceClient
  ~PullClient();                              ///< sends a Bye
  PullClient(const PullClient&) = delete;
  PullClient& operator=(const PullClient&) = delete;

  int open(Duration timeout);  ///< waits for a session
  int wait(Duration timeout);  ///< waits for a newer state(); see tendon_wait()
  const DeviceState& state() const noexcept { return newest_; }

  int send(std::uint64_t tick, const Touch& touch);
  int request(const tendon_order& order, Duration timeout);
  int describe(Duration timeout);  ///< waits for the descriptions of client()

  const ForceClient& client() const noexcept { return *client_; }
  std::uint64_t skipped() const noexcept { return skipped_; }  ///< states that another one replaced before wait()
  const HandleDescription* handle() const noexcept { return client_->handle() ? &*client_->handle() : nullptr; }

  const char* why() const noexcept { return why_.data(); }
  /// Sets why() and returns `result`. Does not use the heap.
  [[gnu::format(printf, 3, 4)]] int fail(int result, const char* format, ...) noexcept;

 private:
  static constexpr std::size_t kKept = 32;  ///< states that can be answered; see tendon_force.tick
  struct Kept {
    DeviceState hand{};
    std::uint64_t session = 0;  ///< 0: none
  };

  void see(const DeviceState& hand);
  LocalTime turn(LocalTime now);
  void change_phase();
  std::string trouble() const;
  void sleep(LocalTime now, LocalTime until);
  int idle();
  template <class Done>
  int serve_until(Duration timeout, Done done);
  bool give(const tendon_order& order);
  bool connected() const noexcept { return client_->phase() == ForceClient::Phase::kOpen; }

  ServerName name_;
  bool observe_;
  bool poll_;
  bool has_key_;
  UdpTransport transport_;
  BusyLink busy_{transport_};
  std::optional<ForceClient> client_;

  ForceClient::Phase phase_ = ForceClient::Phase::kGreeting;
  std::uint64_t session_ = 0;  ///< number of the newest one
  std::string trouble_;        ///< the reason for the end of the newest session or attempt
  bool lost_ = false;          ///< the caller must still be told that a session has ended
  bool ended_ = false;         ///< permanently

  DeviceState newest_{};
  bool fresh_ = false;  ///< the caller has not received newest_
  std::uint64_t skipped_ = 0;
  std::array<Kept, kKept> kept_{};
  std::size_t next_kept_ = 0;
  std::array<char, 320> why_{};
};

}  // namespace tendon
