// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "clients/bridge/igtl/igtl_message.h"
#include "clients/bridge/igtl/igtl_station.h"
#include "clients/bridge/stream_freshness.h"

namespace tendon::bridge::igtl {

/// The state of the connection to one OpenIGTLink program. This class does not use sockets or clocks.
///
///     session.take(now, bytes);                             for everything received, then
///     for each station: session.ask(moment, i, device);     also at due()
///     session.send(station.turn(…));                        for each station
///     write session.stream(), session.sent(n)
///
/// The requested force is the sum of both inputs of a station; F acts on the hand at p:
///
///     F = stiffness (target − p) + command       the spring follows the hand at the rate of the device
///
/// * **Freshness.** StreamFreshness determines how long a target is valid. If the program only sends it once, it is
///   valid until the program disconnects. A command is valid for kCommandFor. When both have expired, the server fades
///   the force.
/// * **Newest wins.** The session requests a force at most once per kShortest, and uses the newest messages.
/// * **Bounded.** The session does not store bodies that it does not use or that are longer than kLongestBody. It ends
///   the connection (`end()`) if a header is not valid, if a size is larger than kLongestSkipped, or if the program has
///   more than kMaxUnread unread bytes. It counts all other invalid messages, and reports the first one of each name.
///
/// Thread-safe: no. Realtime-safe: no.
class Session {
 public:
  static constexpr std::size_t kLongestBody = 4096;
  static constexpr std::uint64_t kLongestSkipped = std::uint64_t{1}
                                                   << 30U;  ///< the size of an image with 512³ voxels of 64 bits
  static constexpr std::size_t kMaxUnread = 64 * 1024;
  static constexpr Duration kCommandFor = std::chrono::milliseconds(200);  ///< two intervals at 10 Hz
  static constexpr Duration kShortest = std::chrono::microseconds(250);
  static constexpr std::size_t kMaxWarnings = 8;

  struct Counts {
    std::uint64_t used = 0;     ///< valid targets and commands
    std::uint64_t ignored = 0;  ///< messages of other types or names
    std::uint64_t invalid = 0;  ///< wrong CRC, size, unit, version or value
  };

  /// `stations` must outlive the session and its requests. `number` identifies the program for each BridgedDevice.
  Session(BridgedDevice::Program number, std::span<const Station> stations);

  void take(LocalTime now, Bytes bytes);
  /// Requests the force for station `i`, if it is due. Returns true if it should be sent immediately.
  bool ask(const Moment& now, std::size_t i, BridgedDevice& bridged);
  LocalTime due() const noexcept;  ///< the next time when ask() must be called

  void send(Bytes messages);
  bool take_status_request() { return std::exchange(wants_status_, false); }  ///< it has sent GET_STATUS
  Bytes stream() const { return std::span(out_).subspan(sent_); }
  void sent(std::size_t bytes);

  const std::string& end() const { return end_; }  ///< reason for the end of the connection; empty while it is open
  std::optional<std::string> next_sentence();
  const Counts& counts() const { return counts_; }

 private:
  struct Wish {
    std::optional<Vec3> target{};  ///< mm
    StreamFreshness freshness{};
    std::optional<Vec3> command{};  ///< N
    LocalTime command_until{};
    bool changed = false;
    bool pulls = false;  ///< the newest request contains the spring
    bool pushes = false;
    bool refused = false;
    LocalTime asked{};
  };
  struct Input {
    std::size_t station;
    bool is_target;
  };

  std::optional<Input> input_of(const Header& header) const;
  void take(LocalTime now, const Header& header, const Input& input, Bytes body);
  void warn(const std::string& about, const std::string& sentence);

  BridgedDevice::Program number_;
  std::span<const Station> stations_;
  std::vector<Wish> wishes_;
  Buffer in_;
  std::uint64_t skip_ = 0;  ///< the number of bytes that are skipped
  Buffer out_;
  std::size_t sent_ = 0;
  bool wants_status_ = true;
  std::string end_;
  std::set<std::string> warned_;
  std::deque<std::string> sentences_;
  Counts counts_;
};

}  // namespace tendon::bridge::igtl
