// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/status.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/support/refusal.h"
#include "tests/tools/injector/proxy/terminal_view.h"

namespace tendon::injector::status_test {
namespace {

using namespace std::chrono_literals;

/// After 1000 datagrams. The release error is 2 ms for `late` datagrams and 40 µs for the others.
Status status(int late) {
  Status s;
  s.elapsed = 10s;
  ProxyMeasurements& up = s.directions[0];
  for (int i = 0; i < 1000; ++i) {
    ++up.counters.received;
    ++up.counters.forwarded;
    up.delay.observe(20ms);
    up.release_error.observe(i < late ? 2ms : 40us);
  }
  s.directions[1].counters.received = 1;  // an answer
  s.timer_floor.observe(35us);
  return s;
}

TEST(Verdict, IsInvalidWhenMoreThanOneInAHundredLeftTooLate) {
  EXPECT_TRUE(why_invalid(status(10), 1ms).empty());
  const std::vector<std::string> why = why_invalid(status(11), 1ms);
  ASSERT_EQ(why.size(), 1U);
  EXPECT_TRUE(why[0].starts_with("up: ")) << why[0];
  EXPECT_TRUE(why_invalid(status(11), 3ms).empty());
}

TEST(Verdict, IsInvalidWhenAnythingWasLostThatTheNetworkDidNotLose) {
  Status s = status(0);
  EXPECT_TRUE(why_invalid(s, 1ms).empty());
  s.directions[0].counters.dropped[static_cast<std::size_t>(Cause::kLoss)] = 500;
  s.directions[0].counters.refused_clients = 5;
  EXPECT_TRUE(why_invalid(s, 1ms).empty()) << "a lossy network and strangers are no fault";
  s.overflowed = 1;
  EXPECT_EQ(why_invalid(s, 1ms).size(), 1U);
  s.directions[1].counters.refused_full = 1;
  EXPECT_EQ(why_invalid(s, 1ms).size(), 2U);
  s.directions[1].counters.unsent = 1;
  EXPECT_EQ(why_invalid(s, 1ms).size(), 3U);
  s.unrecorded = 1;
  EXPECT_EQ(why_invalid(s, 1ms).size(), 4U);
}

TEST(Verdict, IsInvalidWhenNothingCameBack) {
  Status s = status(0);
  s.server = parse_address("127.0.0.1:47441");
  s.directions[1].counters.received = 0;
  ASSERT_EQ(why_invalid(s, 1ms).size(), 1U);
  EXPECT_EQ(why_invalid(s, 1ms)[0], "no answer from 127.0.0.1:47441 to 1000 datagrams");
  s.directions[0].counters.forwarded = 0;
  EXPECT_TRUE(why_invalid(s, 1ms).empty()) << "nobody has asked it anything";
}

TEST(Status, AsJsonSaysWhyARunIsInvalid) {
  const std::string good = in_json(status(0), 1ms).str();
  EXPECT_NE(good.find(R"("valid":true,"invalid_because":[])"), std::string::npos) << good;
  const std::string bad = in_json(status(500), 1ms).str();
  EXPECT_NE(bad.find(R"("valid":false,"invalid_because":["up: )"), std::string::npos) << bad;
}

TEST(Status, SaysHowOftenATraceWasPlayedAndWhatCameAfterIt) {
  Status s = status(0);
  EXPECT_EQ(in_json(s, 1ms).str().find("\"played\""), std::string::npos);
  s.directions[0].played = 3.5;
  s.directions[0].counters.after_end = 2;
  EXPECT_TRUE(says(in_json(s, 1ms).str(), R"("after_end":2,"played":3.5,)"));
  const std::string text = end_text({"127.0.0.1:1", "127.0.0.1:2", 7, {}, 1ms}, s);
  EXPECT_TRUE(says(text, "0 lost, 2 after the end of the trace\n"));
  EXPECT_TRUE(says(text, "         played 3.5 times\n")) << text;
  EXPECT_EQ(played_text(1), "1");
  EXPECT_EQ(played_text(1200.456), "1200.46");
}

TEST(TerminalView, ShowsWhatIsNewSinceBeforeAndFitsTheTerminal) {
  Status before = status(0);
  before.elapsed = 9s;
  Status now = status(0);
  for (int i = 0; i < 500; ++i) {
    ++now.directions[0].counters.received;
    ++now.directions[0].counters.forwarded;
    now.directions[0].delay.observe(50ms);
  }
  now.directions[0].counters.dropped[static_cast<std::size_t>(Cause::kOutage)] = 5;
  const Heading heading{"127.0.0.1:1", "127.0.0.1:2", 7, {"wifi-bad", "lan"}, 1ms};
  const std::string view = terminal_view(heading, now, before, "both la", 60);
  EXPECT_NE(view.find("up         500"), std::string::npos) << view;
  EXPECT_NE(view.find("50.00    50.00    50.00"), std::string::npos)
      << "the delays of the last second are those near 50 ms\n"
      << view;
  EXPECT_NE(view.find("5 lost (outage 5)"), std::string::npos) << view;
  EXPECT_TRUE(view.ends_with("\n> both la")) << view;
  std::istringstream lines(view);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 62U) << line;  // µ has two bytes
}

}  // namespace
}  // namespace tendon::injector::status_test
