// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <span>

#include "clients/plug/plug.h"

namespace tendon::plug {
namespace {

/// Has so many datagrams for us, and never takes one.
class Full : public Link {
 public:
  explicit Full(int count) : left(count) {}
  void send(const Address&, std::span<const std::byte>) override {}
  std::size_t receive(Address&, std::span<std::byte>) override {
    return left > 0 ? static_cast<std::size_t>(left--) : 0;
  }
  int left;
};

TEST(Plug, TakesWhatComesForASessionThatIsOver) {
  Full watcher(3);
  Full controller(3);
  const Address server = parse_address("127.0.0.1:47100");
  const LocalTime now(std::chrono::seconds(100));
  Plug plug({watcher, server}, {controller, server}, {.new_seed = [] { return Seed{}; }}, now);
  plug.turn(now);
  EXPECT_EQ(watcher.left, 0);
  EXPECT_EQ(controller.left, 0) << "a socket that stays readable wakes its owner for ever";
}

}  // namespace
}  // namespace tendon::plug
