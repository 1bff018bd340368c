// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/tools/conformance/toy/session.h"

namespace tendon::conformance {

class ToyServer : public ToyPeer {
 public:
  ToyServer(const std::optional<Key>& key, Fault fault);
  void receive(LocalTime now, int port, Span datagram) override;
  void tick(LocalTime now) override;

 private:
  struct Member {
    int port;
    std::string name;
    pb::Role role;
    Sixteen random;
    Bytes answer;
    ToySession session;
    bool open;
    std::uint32_t every = 10;   ///< ms
    std::uint32_t silence = 0;  ///< ms, of a deadband
    std::uint64_t said_at = 0;  ///< tick of the last state
    std::uint64_t sequence = 0;
    std::uint64_t forces = 0;
    std::uint64_t reports = 0;
    LocalTime reported{};
    std::map<std::uint32_t, pb::Control> waiting;
    std::map<std::uint32_t, pb::ControlAck> answered;
    std::uint32_t next_request = 1;
    std::vector<pb::Frame> due{};
    std::vector<std::string> features{};
    bool coupled = false;
    std::uint64_t ports = 0;
  };
  bool is(Fault fault) const noexcept { return fault_ == fault; }
  void greet(LocalTime now, int port, Span datagram);
  void refuse(int port, const Greeting& greeting, pb::Code code);
  void take(Member& member, const pb::Frame& frame);
  void execute(Member& member, const pb::Control& control);
  void couple(Member& member, const pb::Couple& theirs, pb::ControlAck& ack) const;
  pb::Frame in_columns(const pb::DeviceState& state) const;
  pb::Frame port(LocalTime now, Member& member) const;
  pb::Code set_deadband(Member& member, const pb::SetStateDeadband& asked) const;
  pb::DeviceDescription describe() const;
  const Member* holder() const;
  std::optional<pb::Frame> report(LocalTime now, Member& member) const;
  void open(LocalTime now, Member& member);

  std::optional<Key> key_;
  Fault fault_;
  std::vector<Member> members_;
  std::uint32_t next_id_ = 7;
  std::uint64_t tick_ = 0;
  std::uint64_t rendered_ = 0;
  std::uint32_t holder_ = 0;
  double hellos_ = 40;
  LocalTime hellos_at_{};
};

}  // namespace tendon::conformance
