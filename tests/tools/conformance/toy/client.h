// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/tools/conformance/toy/session.h"

namespace tendon::conformance {

class ToyClient : public ToyPeer, public Guest {
 public:
  ToyClient(const std::optional<Key>& key, pb::Role role, bool asks, Fault fault);
  void receive(LocalTime now, int port, Span datagram) override;
  void tick(LocalTime now) override;
  void start() override;
  void ask_to_end() override { ending_ = true; }
  void kill() override { running_ = false; }
  bool running() override { return running_; }

 private:
  bool is(Fault fault) const noexcept { return fault_ == fault; }
  void begin();
  void settle(LocalTime now, Span datagram);
  void say_hello();
  void take(const pb::Control& control);

  std::optional<Key> key_;
  pb::Role role_;
  bool asks_;
  Fault fault_;
  bool running_ = false;
  bool ending_ = false;
  std::uint8_t attempts_ = 0;
  std::optional<Attempt> attempt_;
  std::optional<Sixteen> cookie_;
  std::optional<LocalTime> hello_at_;
  int hellos_ = 0;
  bool refused_ = false;
  std::optional<ToySession> session_;
  std::optional<std::uint64_t> tick_;
  bool tick_is_new_ = false;
  std::uint64_t sequence_ = 0;
  bool answered_ = false;
  int asked_ = 0;
  LocalTime ask_at_{};
  std::vector<pb::ControlAck> answers_;  ///< to requests of the server
  std::vector<pb::ControlAck> due_;
};

}  // namespace tendon::conformance
