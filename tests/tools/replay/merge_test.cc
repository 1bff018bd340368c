// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/merge.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/recording/byte_sink.h"
#include "server/recording/mcap_reader.h"
#include "server/recording/recorder.h"
#include "tests/server/scratch_folder.h"

namespace tendon::replay::merge_test {
namespace {

using namespace std::chrono_literals;
using tendon::testing::ScratchFolder;

constexpr Duration kAhead = 250ms;  // of the follower's clock

/// Ten seconds of a coupling. `epoch`: 1 for the leader, 2 for the follower. `drift`: of this end's clock. `way`: delay
/// of its received datagrams.
void record(const std::filesystem::path& file, std::uint64_t epoch, Duration ahead, double drift = 0,
            Duration way = 2980us) {
  FileSink sink(file);
  Recorder recorder({.scene = {.text = "", .seed = 1, .version = "1", .commit = "c", .unix_offset = 1000s},
                     .ports = true,
                     .started = LocalTime(ahead)},
                    sink);
  const auto local = [&](Duration time) { return LocalTime(ahead + time + from_seconds(drift * seconds(time))); };
  const auto late = static_cast<std::uint64_t>((way + 999us) / 1ms);
  for (std::uint64_t tick = 1; tick <= 10'000; ++tick) {
    const LocalTime at = local(tick * 1ms);
    PortRecord port{.tick = tick, .at = at};
    port.sent.epoch = epoch;
    port.sent.sequence = tick;
    if (tick > late) {
      port.peer.emplace();
      port.peer->epoch = 3 - epoch;
      port.peer->sequence = tick - late;
      port.peer_arrived = local((tick - late) * 1ms + way);
    }
    recorder.record(port);
    StepRecord step;
    step.tick = tick;
    step.hand.at = at;
    recorder.record(step);
  }
  recorder.close();
}

struct Read {
  std::map<std::string, int> messages;
  std::map<std::string, std::uint64_t> first;  ///< log_time, ns
};

Read read(const std::filesystem::path& file) {
  Read read;
  McapReader reader(std::make_unique<std::ifstream>(file), file.string());
  while (const auto message = reader.next()) {
    ++read.messages[message->channel.topic];
    read.first.try_emplace(message->channel.topic, message->log_time);
  }
  EXPECT_FALSE(reader.truncated());
  return read;
}

class Merge : public ::testing::Test {
 protected:
  Merge() {
    record(leader_, 1, 0s);
    record(follower_, 2, kAhead);
  }

  ScratchFolder folder_;
  std::filesystem::path leader_ = folder_.path() / "leader.mcap";
  std::filesystem::path follower_ = folder_.path() / "follower.mcap";
  std::filesystem::path both_ = folder_.path() / "both.mcap";
};

TEST_F(Merge, PutsBothEndsIntoTheLeadersTime) {
  std::ostringstream out;
  merge({.leader = leader_, .follower = follower_, .out = both_, .json = true}, out);
  EXPECT_NE(out.str().find("\"offset_s\":0.24999"), std::string::npos) << out.str();
  const Read both = read(both_);
  for (const std::string end : {"/leader", "/follower"}) {
    EXPECT_EQ(both.messages.at(end + "/haptic/step"), 10'000) << end;
    EXPECT_EQ(both.messages.at(end + "/haptic/port"), 10'000) << end;
    EXPECT_EQ(both.messages.at(end + "/scene"), 1) << end;
    // The delays in both directions are equal, so the offset is exact.
    const auto first = static_cast<std::int64_t>(both.first.at(end + "/haptic/step"));
    EXPECT_NEAR(static_cast<double>(first - 1'000'001'000'000), 0, 2e3) << end;
  }
  EXPECT_GE(both.messages.at("/merge/clock"), 10);
}

TEST_F(Merge, ProvesABoundOfHalfTheRoundTrip) {
  std::ostringstream out;
  merge({.leader = leader_, .follower = follower_, .out = both_, .json = false}, out);
  EXPECT_NE(out.str().find("± 2.98"), std::string::npos) << out.str();
}

TEST_F(Merge, SaysHowTheClocksDriftAndWarnsAndRefusesAboveTheBound) {
  const auto printed = [this](double drift, Duration way) {
    for (const auto& file : {leader_, follower_, both_}) std::filesystem::remove(file);
    record(leader_, 1, 0s, 0, way);
    record(follower_, 2, kAhead, drift, way);
    std::ostringstream out;
    try {
      merge({.leader = leader_, .follower = follower_, .out = both_}, out);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return out.str();
  };
  const std::string usual = printed(50e-6, 50us);
  EXPECT_NE(usual.find("drifts by 50 ± "), std::string::npos) << usual;
  EXPECT_EQ(usual.find("warning"), std::string::npos) << usual;
  const std::string probably = printed(260e-6, 600us);
  EXPECT_NE(probably.find("drifts by 260 ± "), std::string::npos) << probably;
  EXPECT_NE(probably.find("warning: the drift of the clocks probably exceeds the 200 ppm"), std::string::npos)
      << probably;
  const std::string certainly = printed(260e-6, 50us);
  EXPECT_EQ(certainly.find("the relative drift of the clocks is 260 ± "), 0U) << certainly;
  EXPECT_FALSE(std::filesystem::exists(both_));
}

void record_follower_of(const std::filesystem::path& file, const std::vector<std::uint64_t>& leaders, Duration ahead) {
  FileSink sink(file);
  Recorder recorder({.scene = {.text = "", .seed = 1, .version = "1", .commit = "c", .unix_offset = 1000s},
                     .ports = true,
                     .started = LocalTime(ahead)},
                    sink);
  for (std::uint64_t tick = 1; tick <= 10'000; ++tick) {
    const LocalTime at = LocalTime(ahead) + tick * 1ms;
    for (std::size_t i = 0; i < leaders.size(); ++i) {
      PortRecord port{.tick = tick, .channel = static_cast<std::uint32_t>(i), .at = at};
      port.sent.epoch = 2;
      port.sent.sequence = tick;
      if (tick > 3) {
        port.peer.emplace();
        port.peer->epoch = leaders[i];
        port.peer->sequence = tick - 3 - i;
        port.peer_arrived = at - 20us;
      }
      recorder.record(port);
    }
    StepRecord step;
    step.tick = tick;
    step.hand.at = at;
    recorder.record(step);
  }
  recorder.close();
}

TEST_F(Merge, FindsTheStatesOfOneLeaderAmongThoseOfSeveral) {
  const auto shared = folder_.path() / "shared.mcap";
  record_follower_of(shared, {7, 1}, kAhead);
  std::ostringstream out;
  merge({.leader = leader_, .follower = shared, .out = both_, .json = true}, out);
  // The delay from this leader is 1 ms longer than the delay back.
  EXPECT_NE(out.str().find("\"offset_s\":0.2504"), std::string::npos) << out.str();
  EXPECT_EQ(read(both_).messages.at("/follower/haptic/port"), 10'000) << "those of the other leader are left out";
  EXPECT_EQ(read(both_).messages.at("/leader/haptic/port"), 10'000);
}

TEST_F(Merge, OverwritesNothingAndRefusesWhatIsNoPair) {
  std::ostringstream out;
  std::ofstream(both_) << "mine";
  EXPECT_THROW(merge({.leader = leader_, .follower = follower_, .out = both_}, out), std::runtime_error);
  EXPECT_EQ(std::filesystem::file_size(both_), 4U);
  const auto other = folder_.path() / "other.mcap";
  record(other, 7, 0s);
  EXPECT_THROW(merge({.leader = leader_, .follower = other, .out = folder_.path() / "x.mcap"}, out),
               std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "x.mcap"));
}

}  // namespace
}  // namespace tendon::replay::merge_test
