// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/proxy_scheduler.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::worker::proxy_scheduler_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

Seen at_tick(std::uint64_t tick) {
  Seen seen{.hand = {}, .session = 1};
  seen.hand.tick = tick;
  return seen;
}

Touch force(double newtons) { return Vec3(newtons, 0, 0); }

class Played {
 public:
  explicit Played(const ProxyScheduler::Config& config = {}) : scheduler(config, now) { turn(); }

  void turn() {
    while (const auto order = scheduler.turn(now)) {
      if (std::holds_alternative<ProxyScheduler::Launch>(*order)) said.emplace_back("launch");
      if (std::holds_alternative<ProxyScheduler::GiveUp>(*order)) said.emplace_back("give up");
      if (const auto* ask = std::get_if<ProxyScheduler::Ask>(&*order))
        said.push_back("ask " + std::to_string(ask->hand.tick));
      if (const auto* reply = std::get_if<Reply>(&*order)) {
        said.push_back("send " + std::to_string(reply->to.hand.tick));
        sent.push_back(*reply);
      }
    }
  }
  void after(Duration time) {
    now += time;
    turn();
  }
  void see(std::uint64_t tick) {
    scheduler.see(at_tick(tick));
    turn();
  }
  void open() {
    scheduler.opened();
    turn();
  }
  void answer(double newtons = 1) {
    scheduler.answered(now, force(newtons));
    turn();
  }
  void ask(std::uint64_t tick, Duration time, double newtons = 1) {
    see(tick);
    after(time);
    answer(newtons);
  }
  void die() {
    scheduler.ended(now, "it was terminated by signal 9");
    turn();
  }
  std::string news() {
    std::string all;
    for (const std::string& one : said) all += (all.empty() ? "" : ", ") + one;
    said.clear();
    return all;
  }

  LocalTime now{};
  ProxyScheduler scheduler;
  std::vector<std::string> said;
  std::vector<Reply> sent;
};

TEST(Scheduler, AWorkerHasOneStateAtATimeAndThenTheNewest) {
  Played played;
  EXPECT_EQ(played.news(), "launch");
  played.see(1);
  EXPECT_EQ(played.news(), "") << "nobody is there yet";
  played.open();
  EXPECT_EQ(played.news(), "ask 1");
  for (const std::uint64_t tick : {2U, 3U, 4U}) played.see(tick);
  EXPECT_EQ(played.news(), "");
  played.answer();
  EXPECT_EQ(played.news(), "send 1, ask 4");
  EXPECT_EQ(played.sent.at(0).touch.force.x(), 1);
}

TEST(Scheduler, ALateAnswerIsNotSentAndTheWorkerStays) {
  Played played;
  played.open();
  played.see(1);
  played.after(milliseconds(51));
  played.see(9);
  played.news();
  played.answer();
  EXPECT_EQ(played.news(), "ask 9");
  EXPECT_EQ(played.scheduler.stats().late, 1U);
  EXPECT_EQ(played.scheduler.stats().answers, 0U);
}

TEST(Scheduler, TheDeadlineIsThreeTimesTheMedian) {
  Played played({.dead = seconds(9)});
  played.open();
  for (std::uint64_t tick = 1; tick <= 63; ++tick) {  // the deadline becomes 120 ms
    played.ask(tick, milliseconds(40));
  }
  played.ask(100, milliseconds(119));
  EXPECT_EQ(played.scheduler.stats().late, 0U);
  played.ask(101, milliseconds(121));
  EXPECT_EQ(played.scheduler.stats().late, 1U);
  EXPECT_EQ(played.scheduler.stats().median, milliseconds(40));
}

/// An answer is fast if there is no contact, but takes 100 ms if there is contact. The hand must feel every tap.
TEST(Scheduler, QuickAnswersWithoutAForceDoNotMakeSlowOnesLate) {
  Played played;
  played.open();
  std::uint64_t tick = 0;
  for (int tap = 0; tap < 5; ++tap) {
    for (int free = 0; free < 100; ++free) {
      played.ask(++tick, milliseconds(1), 0);
    }
    for (int touch = 0; touch < 4; ++touch) {
      played.ask(++tick, milliseconds(100));
    }
  }
  EXPECT_EQ(played.scheduler.stats().late, 1U) << "the first of all, before anything is known of a touch";
  EXPECT_EQ(played.scheduler.stats().median, milliseconds(100));
}

/// The client expects the interval of the last two answers, which is almost zero without contact.
TEST(Scheduler, AnAnswerOfASlowBodyHoldsUntilTheNextIsLate) {
  Played played;
  played.open();
  for (std::uint64_t tick = 1; tick < 4; ++tick) {
    played.ask(tick, milliseconds(100));
  }
  played.see(4);
  played.answer(0);
  played.ask(5, milliseconds(100));
  EXPECT_EQ(played.sent.back().touch.valid_for, milliseconds(300));
  EXPECT_EQ(played.sent[played.sent.size() - 2].touch.valid_for, milliseconds(300)) << "the one without a force";
}

TEST(Scheduler, AnAnswerOfAQuickBodyHoldsAsLongAsTheClientSays) {
  Played played;
  played.open();
  for (std::uint64_t tick = 1; tick < 9; ++tick) {
    played.ask(tick, milliseconds(16));
    EXPECT_EQ(played.sent.back().touch.valid_for, std::nullopt);
  }
}

/// If there are 180 000 unknowns on two ranks, the first contact takes 0.8 s, and the others take 0.2 s.
TEST(Scheduler, ASlowFirstTouchIsWaitedForAndTenTimesTheMedianAfterIt) {
  Played played;
  played.open();
  played.see(1);
  played.answer(0);
  played.see(2);
  played.news();
  played.after(ProxyScheduler::kDeadAtFirst);
  EXPECT_EQ(played.news(), "");
  EXPECT_EQ(played.scheduler.next_turn(), played.now + Duration(1));
  played.answer();
  for (std::uint64_t tick = 3; tick < 9; ++tick) {
    played.ask(tick, milliseconds(200));
  }
  played.see(9);
  played.news();
  played.after(milliseconds(2000));
  EXPECT_EQ(played.news(), "");
  played.after(Duration(1));
  EXPECT_EQ(played.news(), "give up");
}

TEST(Scheduler, AQuickWorkerIsWaitedForHalfASecond) {
  Played played;
  played.open();
  played.see(1);
  played.answer();
  played.see(2);
  played.news();
  played.after(milliseconds(500));
  EXPECT_EQ(played.news(), "");
  played.after(Duration(1));
  EXPECT_EQ(played.news(), "give up");
}

TEST(Scheduler, AWorkerThatDoesNotAnswerIsReplaced) {
  Played played({.dead = milliseconds(500)});
  played.open();
  played.see(1);
  played.news();
  played.after(milliseconds(500));
  EXPECT_EQ(played.news(), "");
  EXPECT_EQ(played.scheduler.next_turn(), played.now + Duration(1));
  played.after(Duration(1));
  EXPECT_EQ(played.news(), "give up");
  EXPECT_EQ(played.scheduler.stats().why_given_up, "it has not replied for 500 ms");
  played.after(milliseconds(499));
  EXPECT_EQ(played.news(), "");
  played.see(7);
  played.after(milliseconds(1));
  EXPECT_EQ(played.news(), "launch");
  played.see(8);
  played.open();
  EXPECT_EQ(played.news(), "ask 8") << "the newest, no queue";
}

TEST(Scheduler, AWorkerThatIsNotAskedMayBeSilentForEver) {
  Played played;
  played.open();
  played.news();
  played.after(std::chrono::hours(9));
  EXPECT_EQ(played.news(), "");
  EXPECT_EQ(played.scheduler.next_turn(), LocalTime::max());
}

TEST(Scheduler, TheNextWorkersComeLaterAndLater) {
  Played played;
  std::vector<int> waits;
  for (int i = 0; i < 9; ++i) {
    played.open();
    played.die();
    played.news();
    const Duration wait = played.scheduler.next_turn() - played.now;
    waits.push_back(static_cast<int>(wait / milliseconds(1)));
    played.after(wait - Duration(1));
    EXPECT_EQ(played.news(), "");
    played.after(Duration(1));
    EXPECT_EQ(played.news(), "launch");
  }
  EXPECT_EQ(waits, (std::vector<int>{500, 1000, 2000, 4000, 8000, 16000, 30000, 30000, 30000}));
}

TEST(Scheduler, AWorkerThatLastedSetsTheWaitBack) {
  Played played;
  for (int i = 0; i < 3; ++i) {
    played.open();
    played.die();
    played.after(played.scheduler.next_turn() - played.now);
  }
  played.open();
  for (std::uint64_t tick = 1; tick < 60; ++tick) {  // 5.9 s, longer than the next deadline of 4 s
    played.ask(tick, milliseconds(40));
    played.after(milliseconds(60));
  }
  played.die();
  EXPECT_EQ(played.scheduler.next_turn() - played.now, milliseconds(500));
}

TEST(Scheduler, AWorkerThatDiesAtOnceDoesNotSetTheWaitBack) {
  Played played;
  for (int i = 0; i < 3; ++i) {
    played.open();
    played.see(static_cast<std::uint64_t>(i));
    played.answer();
    played.die();
    EXPECT_EQ(played.scheduler.next_turn() - played.now, milliseconds(500 << i));
    played.after(played.scheduler.next_turn() - played.now);
  }
}

TEST(Scheduler, AWorkerThatDoesNotOpenItsStreamIsReplaced) {
  Played played({.start = seconds(5)});
  played.news();
  played.after(seconds(5));
  EXPECT_EQ(played.news(), "give up");
}

TEST(Scheduler, WhatAnOldWorkerSaysAfterwardsIsNotSent) {
  Played played;
  played.open();
  played.see(1);
  played.die();
  played.news();
  played.answer();
  played.open();
  EXPECT_EQ(played.news(), "");
}

TEST(Scheduler, AnUnusableAnswerIsCountedAndDoesNotKeepTheWorkerAlive) {
  Played played({.dead = milliseconds(500)});
  played.open();
  played.see(1);
  played.news();
  for (int i = 0; i < 5; ++i) {
    played.after(milliseconds(100));
    played.scheduler.refused("it contains a number that is not finite");
  }
  EXPECT_EQ(played.scheduler.stats().refused, 5U);
  EXPECT_EQ(played.scheduler.stats().why_refused, "it contains a number that is not finite");
  played.after(milliseconds(1));
  EXPECT_EQ(played.news(), "give up");
}

TEST(Scheduler, AnUnknownForceIsNotSent) {
  Played played;
  played.open();
  played.see(1);
  played.news();
  Touch unknown;
  unknown.unknown = true;
  played.scheduler.answered(played.now, unknown);
  played.see(2);
  EXPECT_EQ(played.news(), "ask 2");
  EXPECT_EQ(played.scheduler.stats().unknown, 1U);
}

ProxyScheduler::Config with_fallback() {
  ProxyScheduler::Config config;
  config.fallback = [](const DeviceState&) {
    Touch touch = Vec3(3, 0, 0);
    touch.error = 0.5;
    return touch;
  };
  return config;
}

TEST(Scheduler, WithAFallbackEveryStateIsAnsweredWhileNoWorkerCan) {
  Played played(with_fallback());
  played.news();
  played.see(1);
  played.see(2);
  EXPECT_EQ(played.news(), "send 1, send 2") << "while the worker starts";
  played.open();
  played.news();
  played.see(3);
  EXPECT_EQ(played.news(), "") << "the worker has a state, and is not late";
  EXPECT_EQ(played.scheduler.next_turn(), played.now + milliseconds(50) + Duration(1));
  played.after(milliseconds(51));
  EXPECT_EQ(played.news(), "send 3") << "late";
  played.see(4);
  EXPECT_EQ(played.news(), "send 4");
  played.die();
  played.see(5);
  EXPECT_EQ(played.news(), "give up, send 5");
  EXPECT_EQ(played.scheduler.stats().fallback, 5U);
}

TEST(Scheduler, TheFallbacksErrorIsRaisedByWhatItLastDifferedFromAnAnswer) {
  Played played(with_fallback());
  played.open();
  played.see(1);
  played.answer(1);
  played.die();
  played.see(2);
  ASSERT_EQ(played.sent.size(), 2U);
  EXPECT_FALSE(played.sent[0].touch.error.has_value());
  EXPECT_EQ(played.sent[1].touch.error, 0.5 + 2);
}

TEST(Scheduler, TicksOfTheAnswersNeverFall) {
  Played played(with_fallback());
  std::uint64_t tick = 0;
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 7; ++i) {
      played.see(++tick);
      played.after(milliseconds(13));
    }
    if (round % 5 == 4) {
      played.die();
      played.after(seconds(31));
      played.open();
    } else {
      played.open();
      played.answer();
    }
  }
  ASSERT_GT(played.sent.size(), 25U);
  EXPECT_GT(played.scheduler.stats().answers, 3U);
  for (std::size_t i = 1; i < played.sent.size(); ++i) {
    EXPECT_GE(played.sent[i].to.hand.tick, played.sent[i - 1].to.hand.tick);
  }
}

TEST(Scheduler, RefusesTimesThatAreNone) {
  EXPECT_THROW(ProxyScheduler({.dead = Duration(-1)}, LocalTime{}), std::invalid_argument);
  EXPECT_THROW(ProxyScheduler({.deadline = Duration(-1)}, LocalTime{}), std::invalid_argument);
  EXPECT_THROW(ProxyScheduler({.retry_min = seconds(40)}, LocalTime{}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::worker::proxy_scheduler_test
