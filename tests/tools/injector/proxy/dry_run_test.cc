// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/dry_run.h"

#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/support/refusal.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector::dry_run_test {
namespace {

std::string printed(const NetworkOptions& network, const DryRun& options) {
  std::ostringstream out;
  dry_run(prepare(network), options, out, nullptr);
  return out.str();
}

TEST(DryRun, PrintsOneObjectPerPacketUpAndDownByTurns) {
  const NetworkOptions network{.profile = {}, .up = "delay=20ms", .down = "loss=100%", .seed = 7};
  EXPECT_EQ(
      printed(network, {.count = 5, .json = true}),
      "{\"dir\":\"up\",\"index\":0,\"t_in_ns\":0,\"verdict\":\"pass\",\"cause\":\"delay\",\"t_out_ns\":20000000}\n"
      "{\"dir\":\"down\",\"index\":0,\"t_in_ns\":0,\"verdict\":\"drop\",\"cause\":\"loss\",\"t_out_ns\":null}\n"
      "{\"dir\":\"up\",\"index\":1,\"t_in_ns\":1000000,\"verdict\":\"pass\",\"cause\":\"delay\",\"t_out_ns\":21000000}"
      "\n"
      "{\"dir\":\"down\",\"index\":1,\"t_in_ns\":1000000,\"verdict\":\"drop\",\"cause\":\"loss\",\"t_out_ns\":null}\n"
      "{\"dir\":\"up\",\"index\":2,\"t_in_ns\":2000000,\"verdict\":\"pass\",\"cause\":\"delay\",\"t_out_ns\":22000000}"
      "\n");
}

TEST(DryRun, OfTheSameSeedIsTheSameAndOfAnotherAnother) {
  NetworkOptions network{.profile = "wifi-bad", .seed = 7};
  const std::string once = printed(network, {.count = 1000, .json = true});
  EXPECT_EQ(printed(network, {.count = 1000, .json = true}), once);
  network.seed = 8;
  EXPECT_NE(printed(network, {.count = 1000, .json = true}), once);
}

TEST(DryRun, SizeAndRateMeetABottleneck) {
  // 1000 bits take 1 ms: at 500 Hz no datagram waits, at 2 kHz all but the first do.
  const NetworkOptions network{.profile = "rate=1Mbit/s overhead=0", .seed = 7};
  EXPECT_NE(printed(network, {.count = 4, .rate_hz = 500, .bytes = 125})
                .find("up   1  at 2.000000 ms  pass queue  after 1.000000 ms"),
            std::string::npos);
  EXPECT_NE(printed(network, {.count = 4, .rate_hz = 2000, .bytes = 125})
                .find("up   1  at 0.500000 ms  pass queue  after 1.500000 ms"),
            std::string::npos);
}

TEST(DryRun, RecordsATraceWhoseReplayIsTheSame) {
  const NetworkOptions network{.profile = "delay=uniform(5ms,35ms) loss=10% duplicate=5%", .seed = 7};
  const PreparedNetwork prepared = prepare(network);
  std::ostringstream decisions;
  std::ostringstream recorded;
  {
    TraceWriter trace(recorded, prepared.header());
    dry_run(prepared, {.count = 2000, .json = true}, decisions, &trace);
  }
  PreparedNetwork again = prepare({.seed = 1});
  std::istringstream file(recorded.str());
  again.replay = std::make_unique<const Trace>(read_trace(file, "trace"));
  std::ostringstream replayed;
  dry_run(again, {.count = 2000, .json = true}, replayed, nullptr);
  EXPECT_EQ(replayed.str(), decisions.str());
}

TEST(Prepare, NamesTheOptionThatIsWrong) {
  const auto refusal = [](const NetworkOptions& network) {
    return thrown_by<std::exception>([&] { prepare(network); });
  };
  EXPECT_TRUE(refusal({.profile = "loss=2"}).starts_with("--profile: ")) << refusal({.profile = "loss=2"});
  EXPECT_TRUE(refusal({.profile = "lan", .down = "loss=2"}).starts_with("--down: "));
  EXPECT_NE(refusal({.replay = "none.csv"}).find("none.csv"), std::string::npos);
}

}  // namespace
}  // namespace tendon::injector::dry_run_test
