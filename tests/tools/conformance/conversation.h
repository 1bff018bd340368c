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

/// So much later than asked the kit still believes that a peer meant to do it at once: virtual machines pause.
inline constexpr Duration kPatience = std::chrono::seconds(3);

/// A correct peer repeats a Hello or a request at this interval.
inline constexpr Duration kRepeat = std::chrono::milliseconds(100);

/// The kit's end of an open conversation: a correct peer that keeps a record of every datagram it said and heard, and
/// can on request say what no correct peer says.
///
/// What is heard is judged at once: header, sealing, numbers, times, and each echo against the record.
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

  /// `wire` and `report` must outlive it.
  Conversation(Wire& wire, Report& report, const Setup& setup);

  // Saying.
  /// With the next packet number, our time and our echo; returns the number.
  std::uint64_t say(pb::Datagram body = {});
  /// With a number of one's own.
  void say_at(std::uint64_t number, pb::Datagram body);
  /// The bytes that `say_at` sends.
  Bytes compose(std::uint64_t number, pb::Datagram body);
  /// Says bytes that must be dropped. A peer that tells of `number` all the same has broken the rule `check`; until
  /// something good is said under that number. `wrong` says what is wrong with them, for the report: "magic 0x55".
  void say_bad(std::string_view check, std::uint64_t number, Span datagram, std::string_view wrong);
  /// Seals anything under a header of one's own, `epochs` keys further on.
  Bytes seal(Head head, Span body, int epochs = 0) const;
  void say_bytes(Span datagram);
  /// The header that `number` has.
  Head head(std::uint64_t number) const;
  std::uint64_t next_number() const noexcept { return next_; }
  /// Leaves a gap: the next number is this one.
  void skip_to(std::uint64_t number) noexcept { next_ = number; }
  /// A peer that does not tell of `number`, which is good, has broken this rule rather than "echo-mask".
  void attribute(std::uint64_t number, std::string_view check) { owners_[number] = check; }
  /// Nothing but that we are there, under the key before.
  void say_old(std::uint64_t number);
  /// From now on under the next key.
  void renew_key();
  /// … and back: the peer has not followed.
  void return_to_old_key();
  /// From now on from another port of ours.
  void move_to(int port) noexcept {
    setup_.port = port;
    moved_ = true;
  }
  /// Our time and echo, as they go into the next datagram.
  void stamp(pb::Datagram& body) const;

  // Hearing, for that long; with a keep-alive of ours every 40 ms.
  void listen(Duration duration) {
    listen_until(duration, [] { return false; });
  }
  /// Until `enough`; false when `patience` was over first.
  bool listen_until(Duration patience, const std::function<bool()>& enough, bool keep_alive = true);
  /// Without a word of ours.
  void overhear(Duration duration) {
    listen_until(
        duration, [] { return false; }, false);
  }
  /// Until the peer has told that it has `number`; says keep-alives meanwhile.
  bool confirmed(std::uint64_t number, Duration patience = kPatience);
  /// Repeats a request until there is an answer, for at most kPatience.
  std::optional<pb::ControlAck> ask(const pb::Control& control);
  /// What the newest echo tells of `number`; empty when it does not reach that far.
  std::optional<bool> told_of(std::uint64_t number) const;

  const std::vector<Heard>& heard() const noexcept { return heard_; }
  /// These bytes of `number` will be said again.
  void will_repeat(std::uint64_t number) { repeated_.insert(number); }
  /// Frames of what was heard from index `since` on.
  template <class Use>
  void for_each_frame(std::size_t since, Use use) const {
    for (std::size_t i = since; i < heard_.size(); ++i) {
      for (const pb::Frame& frame : heard_[i].body.frames()) use(frame);
    }
  }
  std::size_t count_frames(std::size_t since, const std::function<bool(const pb::Frame&)>& wanted) const;
  /// Datagrams at our port that were not of this conversation.
  const std::vector<Bytes>& strangers() const noexcept { return strangers_; }
  /// How often the peer has renewed its key.
  std::uint8_t peer_epoch() const noexcept { return receive_epoch_; }
  const Setup& setup() const noexcept { return setup_; }
  LocalTime now() { return wire_.now(); }
  Report& report() noexcept { return report_; }

 private:
  struct Said {
    std::int64_t sent_ns;
    std::uint64_t order;           ///< of all that was said
    std::int64_t heard_before_ns;  ///< T3 of the newest datagram heard before it left
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
  std::map<std::uint64_t, Said> said_;  ///< the good ones
  struct Bad {
    std::string_view check;  ///< the rule that it tests
    std::string wrong;
  };
  std::map<std::uint64_t, Bad> bad_;  ///< numbers that only bad datagrams had
  std::map<std::uint64_t, std::string_view> owners_;
  std::set<std::uint64_t> repeated_;
  std::vector<Heard> heard_;
  std::vector<Bytes> strangers_;
  std::uint64_t expected_ = 0;                      ///< the peer's next number
  bool moved_ = false;                              ///< what was said to our old port is not heard
  std::map<std::uint64_t, std::int64_t> arrivals_;  ///< T2 as told, by our number
  std::map<std::uint64_t, std::size_t> numbers_;    ///< the peer's; index into heard_
};

}  // namespace tendon::conformance
