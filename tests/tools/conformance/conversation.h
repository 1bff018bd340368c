// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/secrets/crypto.h"
#include "tests/tools/conformance/datagram.h"
#include "tests/tools/conformance/report.h"
#include "tests/tools/conformance/wire.h"

namespace tendon::conformance {

/// Tolerance for an immediate reaction, because virtual machines pause.
inline constexpr Duration kPatience = std::chrono::seconds(3);

/// A correct peer repeats a Hello or a request at this interval.
inline constexpr Duration kRepeat = std::chrono::milliseconds(100);

/// The kit's side of an open session: a correct peer that can also send invalid datagrams. It records both directions
/// and judges each datagram on receipt: header, seal, packet numbers, times, and each echo against the record.
class Conversation {
 public:
  struct Setup {
    int port = 0;
    std::uint8_t suite = 0;
    std::uint32_t connection_id = 0;
    Key send{};  ///< in suites 1 and 2
    Key receive{};
    std::uint8_t version = 1;
  };
  struct Heard {
    std::uint64_t number;
    LocalTime at;
    pb::Datagram body;
  };

  Conversation(Wire& wire, Report& report, const Setup& setup);

  /// Sends `body` with the next packet number, the time and the echo.
  std::uint64_t say(pb::Datagram body = {});
  void say_at(std::uint64_t number, pb::Datagram body);
  Bytes compose(std::uint64_t number, pb::Datagram body);
  /// Sends bytes that the peer must drop. If the peer's echo contains `number` before a valid datagram used it, the
  /// peer violates the rule `check`. `wrong`: the error for the report, for example "magic 0x55".
  void say_bad(std::string_view check, std::uint64_t number, Span datagram, std::string_view wrong);
  Bytes seal(Head head, Span body, int epochs = 0) const;
  void say_bytes(Span datagram);
  Head head(std::uint64_t number) const;
  std::uint64_t next_number() const noexcept { return next_; }
  void skip_to(std::uint64_t number) noexcept { next_ = number; }
  /// If the peer's echo omits `number`, which is valid, reports a violation of `check` instead of "echo-mask".
  void attribute(std::uint64_t number, std::string_view check) { owners_[number] = check; }
  void say_old(std::uint64_t number);
  void renew_key();
  void return_to_old_key();
  void move_to(int port) noexcept {
    setup_.port = port;
    moved_ = true;
  }
  void stamp(pb::Datagram& body) const;

  // Receives for `duration` and sends a keep-alive every 40 ms.
  void listen(Duration duration) {
    listen_until(duration, [] { return false; });
  }
  /// Receives until `enough` returns true; returns false if `patience` elapses first.
  bool listen_until(Duration patience, const std::function<bool()>& enough, bool keep_alive = true);
  void overhear(Duration duration) {
    listen_until(
        duration, [] { return false; }, false);
  }
  /// Waits for an acknowledgement of `number` while sending keep-alives. Returns false after `patience`.
  bool confirmed(std::uint64_t number, Duration patience = kPatience);
  /// Repeats a request until it is answered, for at most kPatience.
  std::optional<pb::ControlAck> ask(const pb::Control& control);
  /// Whether the newest echo acknowledges `number`; nullopt if it does not reach that far.
  std::optional<bool> told_of(std::uint64_t number) const;

  const std::vector<Heard>& heard() const noexcept { return heard_; }
  /// Announces that the datagram `number` will be sent again unchanged.
  void will_repeat(std::uint64_t number) { repeated_.insert(number); }
  template <class Use>
  void for_each_frame(std::size_t since, Use use) const {
    for (std::size_t i = since; i < heard_.size(); ++i) {
      for (const pb::Frame& frame : heard_[i].body.frames()) use(frame);
    }
  }
  std::size_t count_frames(std::size_t since, const std::function<bool(const pb::Frame&)>& wanted) const;
  const std::vector<Bytes>& strangers() const noexcept { return strangers_; }
  std::uint8_t peer_epoch() const noexcept { return receive_epoch_; }
  const Setup& setup() const noexcept { return setup_; }
  LocalTime now() { return wire_.now(); }
  Report& report() noexcept { return report_; }

 private:
  struct Said {
    std::int64_t sent_ns;
    std::uint64_t order;           ///< among all datagrams sent
    std::int64_t heard_before_ns;  ///< T3 of the last datagram that was received before this datagram was sent
  };
  void record(std::uint64_t number, const pb::Datagram& body);
  void hear(const Wire::Arrival& arrival);
  void judge_echo(std::uint64_t number, const pb::Datagram& body);

  Wire& wire_;
  Report& report_;
  Setup setup_;
  std::uint64_t next_ = 0;
  std::uint64_t order_ = 0;
  std::uint64_t newest_echo_ = 0;
  bool echoed_ = false;
  std::uint8_t epoch_ = 0;
  Key send_key_;
  std::optional<Key> previous_key_;
  Key receive_key_;
  std::uint8_t receive_epoch_ = 0;
  LocalTime last_said_{};
  std::map<std::uint64_t, Said> said_;
  struct Bad {
    std::string_view check;
    std::string wrong;
  };
  std::map<std::uint64_t, Bad> bad_;  ///< numbers used only by invalid datagrams
  std::map<std::uint64_t, std::string_view> owners_;
  std::set<std::uint64_t> repeated_;
  std::vector<Heard> heard_;
  std::vector<Bytes> strangers_;
  std::uint64_t expected_ = 0;
  bool moved_ = false;                              ///< datagrams to the old port are not received
  std::map<std::uint64_t, std::int64_t> arrivals_;  ///< T2 as reported by the peer, by our packet number
  std::map<std::uint64_t, std::size_t> numbers_;    ///< maps the packet number of the peer to an index of heard_
};

}  // namespace tendon::conformance
