// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "protocol/secrets/seal.h"
#include "tests/tools/conformance/toy/peer.h"

namespace tendon::conformance {

inline std::int64_t ns(LocalTime time) { return time.time_since_epoch().count(); }
inline Key key_from(std::uint8_t first) { return Key(Bytes32{std::byte{first}, std::byte{0x5A}}); }

class ToySession {
 public:
  /// Shorter than in WIRE.md to keep the tests fast.
  static constexpr std::chrono::seconds kKeyAge{60};
  ToySession(std::uint8_t suite, std::uint32_t connection_id, const Key& send, const Key& receive, Fault fault,
             LocalTime now);
  bool is(Fault fault) const noexcept { return fault_ == fault; }

  /// The accepted frames; empty if the datagram was dropped. `newest`: the packet number was the highest so far.
  struct Content {
    std::vector<pb::Frame> frames;
    bool newest = false;
  };
  std::optional<Content> receive(LocalTime now, Span datagram);
  Bytes say(LocalTime now, const std::vector<pb::Frame>& frames);
  std::vector<Bytes> say_bye(LocalTime now, pb::Code code);
  bool silent_too_long(LocalTime now) const;
  bool over(LocalTime now, Duration timeout) const;
  std::uint32_t connection_id() const noexcept { return connection_id_; }
  std::uint64_t received() const noexcept { return seen_.size(); }
  bool closed = false;

 private:
  SealingKey sealing(const Key& key) const;
  Key renewed(const Key& key) const;
  bool good_header(const Head& head) const;
  bool seen(std::uint64_t number) const;
  std::optional<Bytes> open(LocalTime now, const Head& head, Span datagram);

  std::uint8_t suite_;
  std::uint32_t connection_id_;
  Key send_;
  Key receive_;
  std::optional<Key> previous_;
  std::uint8_t send_epoch_ = 0;
  std::uint8_t receive_epoch_ = 0;
  LocalTime moved_on_{};
  LocalTime renewed_;
  Fault fault_;
  std::uint64_t next_ = 0;
  std::optional<LocalTime> last_sent_;
  LocalTime last_heard_;
  std::set<std::uint64_t> seen_;
  std::set<std::uint64_t> spoilt_;  ///< by damaged copies
  std::uint64_t echo_number_ = 0;
  std::int64_t echo_sent_ = 0;
  LocalTime echo_at_{};
};

}  // namespace tendon::conformance
