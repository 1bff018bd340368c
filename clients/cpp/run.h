// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/cpp/force_client.h"
#include "clients/cpp/server_name.h"

namespace tendon {

/// What run() needs to know; CommandLine (options.h) fills it from a command line.
struct Options {
  ServerName server = "127.0.0.1:47100";  ///< looked up at the start, and again before each further attempt
  ForceClient::Config client;             ///< `seed` is replaced by one from the system
  Duration duration{};                    ///< ends after this time; 0 = at SIGINT or SIGTERM
  /// Never sleeps: a state is answered some 10 to 50 µs sooner, and a whole processor is taken all the time. run() says
  /// so where there is only one.
  bool busy = false;
  bool json = false;  ///< the closing summary as one JSON object on stdout, not as text on stderr
  /// Called with read_clock()'s time (machine.h) whenever `silence` (at least 1 ms) has passed without a state for the
  /// callback, also before the first: what must not go on without a hand stops there. For one device alone.
  std::function<void(LocalTime now)> on_silence{};
  Duration silence = std::chrono::milliseconds(10);
};

/// Runs a guest in real time, on this thread, until it is told to stop (Options::duration, SIGINT or SIGTERM); then it
/// says Bye. This is all that `main` needs. Returns the exit code:
///
///     0   it has been connected to the server
///     1   it could not connect, there is no such host, the server refused it for good, another has its place, or the
///         callback threw
///
/// Another controller at the device (Code::kBusy) and a server that goes down are not for good: it keeps trying. stderr
/// gets one sentence for each change of the connection. stdout gets only the callback's own output and, with `json`,
/// what the server says of our forces once a second, {"report":{"number":1, …}}, and the summary,
/// {"summary":{"duration_s":…, …}}. Without `json` stderr gets the server's sentence when forces were late.
///
/// One at a time in a process, because the signal handlers are the process's.
int run(const Options& options, Physics physics);  ///< a controller
int run(const Options& options, Watch watch);      ///< an observer

/// The same for one engine that touches several devices of the server, as two hands hold one object: its callbacks by
/// the names of their devices. They are called one after the other on this thread and need no locks. Each device has a
/// session of its own; the options hold for each, and what is said of a session names its device.
/// `options.client.device` must be empty. 0 means that every session was open once; the run ends when one ends for
/// good.
int run(const Options& options, const std::map<std::string, Physics>& physics);

/// One of several hands that hold the same object.
struct HandAt {
  std::string device;                  ///< its name at its server
  std::optional<ServerName> server{};  ///< empty: Options::server
};

/// An engine that several hands touch at once: the newest state of each in, empty while that hand is not there; the
/// answer to each of these states out, in the same order. One for an empty state does not matter.
using Together = std::function<std::vector<Touch>(std::span<const std::optional<DeviceState>> hands)>;

/// The same for an engine with one solution for all hands, at devices of one server or of several, which share
/// `options.client.key`. It is called when a hand has a new state. It then sends a force to every hand, tagged with
/// the state of this hand. There must be at least one hand. An exception of the engine ends the run after a Bye to each
/// server.
int run(const Options& options, const std::vector<HandAt>& hands, const Together& engine);

/// An engine that computes elsewhere: in another process, or on many machines. run() never waits for it.
class Elsewhere {
 public:
  virtual ~Elsewhere() = default;

  /// The newest state of the hand. Returns at once.
  virtual void see(LocalTime now, const Seen& seen) = 0;
  /// Does what is due at `now`. The next answer, if there is one: called until it is empty.
  virtual std::optional<Reply> turn(LocalTime now) = 0;
  /// The latest time for the next turn. A descriptor that can be read makes it due at once.
  virtual LocalTime next_turn() const = 0;
  /// For poll(): readable when there is something to do.
  virtual int descriptor() const = 0;
};

/// The same as a controller whose forces come from `engine`, for one device. Forces that come too late to be sent
/// (ForceClient::answer) are dropped.
int run(const Options& options, Elsewhere& engine);

}  // namespace tendon
