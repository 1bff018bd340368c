// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace tendon::bench {

// A client process sends a request of 200 bytes to a server process on the same machine, which sends a reply of 64 bytes.
inline constexpr std::size_t kRequestBytes = 200;
inline constexpr std::size_t kReplyBytes = 64;
/// Timeout for a reply.
inline constexpr Duration kPatience = std::chrono::seconds(1);

/// Shared memory of the client and the server.
class EchoSetup {
 public:
  /// Returns a name that is unique on this machine.
  std::string name() const { return "tendon_bench_" + std::to_string(number); }
  int number = 0;
  /// Called by the server when it is ready. The address has at most 127 bytes.
  void announce(const std::string& address);
  /// Returns the address of the server. Throws std::runtime_error if there is none after ten seconds.
  std::string address() const;

  /// Called by the server before each reply. Waits without sleeping.
  void delay_reply() const;
  Duration reply_delay{};

 private:
  std::array<char, 128> address_{};
  std::atomic<bool> announced_{false};
};

class EchoClient {
 public:
  EchoClient() = default;
  virtual ~EchoClient() = default;
  EchoClient(const EchoClient&) = delete;
  EchoClient& operator=(const EchoClient&) = delete;

  /// Sends a request and waits for the reply. Returns false if the reply is lost.
  virtual bool request_reply() = 0;
};

struct Load {
  std::size_t requests = 0;
  std::size_t warm_up = 0;  ///< number of additional requests at the start, which are not measured
  Duration period{};        ///< interval between requests; 0: no pauses
  Duration reply_delay{};
  int priority = 0;  ///< real-time priority of all threads of the client and the server; 0: default scheduling
};

struct EchoTimes {
  std::vector<double> us;  ///< duration of each call of request_reply()
  std::uint64_t lost = 0;
};

using MakeClient = std::function<std::unique_ptr<EchoClient>(EchoSetup&)>;

/// Throws std::runtime_error if there is no reply within ten seconds.
EchoTimes measure_echo(const Load& load, EchoClient& client);
/// Runs `serve` in another process, which is killed at the end.
EchoTimes measure_echo(const Load& load, const std::function<void(EchoSetup&)>& serve, const MakeClient& make);

/// The main function of a program that measures a library. The arguments of the program are the members of Load, in µs.
/// The output is the name, the number of lost replies, and the time of each request in µs.
int peer_main(int argc, char** argv, const std::string& name, const std::function<void(EchoSetup&)>& serve,
              const MakeClient& make);

}  // namespace tendon::bench
