// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/cpp/dscp.h"
#include "clients/cpp/field/field.h"
#include "clients/cpp/force_client.h"
#include "clients/cpp/server_name.h"

namespace tendon {

/// Settings of run(). CommandLine (options.h) fills them from a command line.
struct Options {
  ServerName server = "127.0.0.1:47100";  ///< resolved at the start and again before each further attempt
  ForceClient::Config client;             ///< `seed` is replaced by random bytes from the operating system
  Duration duration{};                    ///< 0: run until SIGINT or SIGTERM
  /// Polls without sleeping: answers are 10 to 50 µs faster, for a fully loaded processor. Warns if there is only one.
  bool busy = false;
  std::optional<Dscp> dscp{};  ///< empty: datagrams are not marked
  bool json = false;           ///< print the final summary to stdout as one JSON object instead of to stderr as text
  /// Called with the time of read_clock() (machine.h) when no state has arrived for `silence` (at least 1 ms), also
  /// before the first state. Stop anything here that must not continue without an operator. Only for one device.
  std::function<void(LocalTime now)> on_silence{};
  Duration silence = std::chrono::milliseconds(10);
  /// Uploaded in each session (ForceClient::use). While the server renders it, the answers of the engine are sent as
  /// truths (Touch::truth). Until then, and if the server refuses it, they are sent as forces. run() prints the reason.
  std::optional<Field> field{};
};

/// Runs a client in real time on the calling thread until Options::duration, SIGINT or SIGTERM, then sends a Bye.
/// Returns the exit code for main():
///
///     0   a session was open at least once
///     1   connecting failed, the host is unknown, the server refused permanently, another program replaced this
///         client, or the callback threw
///
/// If another controller holds the device (Code::kBusy) or the server shuts down, run() keeps trying. It prints one
/// sentence to stderr for each change of the connection. stdout contains only the output of the callback and, with
/// `json`, the server's reports on the received forces once per second, {"report":{"number":1, …}}, and the summary,
/// {"summary":{"duration_s":…, …}}. Without `json`, stderr contains a warning if forces were late. Only one run() at a
/// time per process, because it installs signal handlers.
int run(const Options& options, Physics physics);  ///< a controller
int run(const Options& options, Watch watch);      ///< an observer

/// Runs an engine for several devices of a server, for example if two hands hold the same object. The map assigns a
/// callback to each device name. The callbacks run sequentially on this thread and need no locks. Each device has its
/// own session with these options, and messages contain the device name. `options.client.device` must be empty.
/// Returns 0 if every session was open at least once. The run ends if one of the sessions cannot be opened again.
int run(const Options& options, const std::map<std::string, Physics>& physics);

/// One of several hands that hold the same object.
struct HandAt {
  std::string device;                  ///< device name at its server
  std::optional<ServerName> server{};  ///< empty: Options::server
};

/// An engine that computes the forces of several hands together. An entry of `hands` is empty while that hand is not
/// connected. Returns one answer for each entry in the same order; answers to empty entries are ignored.
using Together = std::function<std::vector<Touch>(std::span<const std::optional<DeviceState>> hands)>;

/// Runs an engine that solves for all hands at once. The devices may belong to several servers that share
/// `options.client.key`. The engine is called when any hand has a new state. Each hand then receives a force tagged
/// with its state. `hands` must not be empty. If the engine throws, run() sends a Bye to each server and ends.
int run(const Options& options, const std::vector<HandAt>& hands, const Together& engine);

/// An engine that computes asynchronously, in another process or on a cluster. run() never blocks on it.
class Elsewhere {
 public:
  virtual ~Elsewhere() = default;

  virtual void see(LocalTime now, const Seen& seen) = 0;  ///< takes the newest state; must return immediately
  /// Performs the work due at `now`. Returns the next answer, if any. run() calls it until it returns empty.
  virtual std::optional<Reply> turn(LocalTime now) = 0;
  virtual LocalTime next_turn() const = 0;  ///< the turn is due earlier if descriptor() becomes readable
  virtual int descriptor() const = 0;       ///< for poll(); readable when turn() has work to do
};

/// Runs a controller for one device with the forces of `engine`. Late forces are dropped; see ForceClient::answer.
int run(const Options& options, Elsewhere& engine);

}  // namespace tendon
