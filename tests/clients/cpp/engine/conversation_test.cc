// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/conversation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::conversation_test {
namespace {

/// These are not round numbers, so that rounding would be visible.
DeviceState odd_state(std::uint64_t tick) {
  const double t = 0.1 * static_cast<double>(tick);
  DeviceState hand;
  hand.tick = tick;
  hand.sampled = PeerTime(Duration(1'234'567'891) * static_cast<std::int64_t>(tick));
  hand.position = Vec3(std::sin(t), std::exp(-t), -1e-300 * t);
  hand.velocity = Vec3(-0.0, 1.0 / 3, 1e12);
  hand.force_applied = Vec3(0.1, -0.2, std::numeric_limits<double>::denorm_min());
  hand.energy = t / 7;
  hand.permitted_force = std::numeric_limits<double>::infinity();
  hand.reasons = 0xdeadbeef;
  hand.force_sequence = tick + 7;
  hand.force_age = Duration(987'654'321);
  hand.mode = Mode::kDecaying;
  hand.device = 2;
  hand.channel = 3;
  return hand;
}

Physics engine(double stiffness) {
  return [stiffness, memory = Vec3(0, 0, 0)](const DeviceState& hand) mutable -> Touch {
    memory = 0.9 * memory + hand.position / 3;
    Touch touch(-stiffness * memory + 1e-9 * hand.velocity + hand.force_applied * hand.energy);
    touch.force.y() += seconds(hand.force_age) + seconds(hand.sampled.time_since_epoch()) +
                       static_cast<double>(hand.force_sequence + hand.reasons + hand.device + hand.channel) +
                       static_cast<double>(hand.mode) / hand.permitted_force;
    if (hand.tick % 2 == 0) touch.stiffness = Mat3(stiffness * Mat3::Identity() + memory * memory.transpose());
    return touch;
  };
}

std::string conversation(const Physics& physics, std::uint64_t answers) {
  std::ostringstream file;
  const Physics wrapped = recorded(physics, file);
  for (std::uint64_t tick = 1; tick <= answers; ++tick) wrapped(odd_state(tick));
  return file.str();
}

Replay replayed(const std::string& text, const Physics& physics) {
  std::istringstream file(text);
  return replay(file, physics);
}

TEST(Conversation, ReplaysBitForBit) {
  const Replay same = replayed(conversation(engine(500), 300), engine(500));
  EXPECT_EQ(same.answers, 300u);
  EXPECT_EQ(same.differing, 0u);
  EXPECT_FALSE(same.first);
  EXPECT_EQ(same.text(), "300 answers, all the same");
}

TEST(Conversation, GivesTheEngineWhatItSawToTheLastBit) {
  std::istringstream file(conversation(engine(500), 50));
  std::uint64_t tick = 0;
  replay(file, [&](const DeviceState& hand) -> Touch {
    const DeviceState was = odd_state(++tick);
    EXPECT_EQ(hand.tick, was.tick);
    EXPECT_EQ(hand.sampled, was.sampled);
    EXPECT_EQ(hand.position, was.position);
    EXPECT_EQ(hand.velocity, was.velocity);
    EXPECT_TRUE(std::signbit(hand.velocity.x()));
    EXPECT_EQ(hand.force_applied, was.force_applied);
    EXPECT_EQ(hand.energy, was.energy);
    EXPECT_EQ(hand.permitted_force, was.permitted_force);
    EXPECT_EQ(hand.reasons, was.reasons);
    EXPECT_EQ(hand.force_sequence, was.force_sequence);
    EXPECT_EQ(hand.force_age, was.force_age);
    EXPECT_EQ(hand.mode, was.mode);
    EXPECT_EQ(hand.device, was.device);
    EXPECT_EQ(hand.channel, was.channel);
    return {};
  });
  EXPECT_EQ(tick, 50u);
}

TEST(Conversation, NoticesOneBitInOneForce) {
  const std::string text = conversation(engine(500), 100);
  std::uint64_t calls = 0;
  const Replay found = replayed(text, [&, same = engine(500)](const DeviceState& hand) {
    Touch touch = same(hand);
    if (++calls == 42) touch.force.z() = std::nextafter(touch.force.z(), 1e9);
    return touch;
  });
  EXPECT_EQ(found.answers, 100u);
  EXPECT_EQ(found.differing, 1u);
  ASSERT_TRUE(found.first);
  EXPECT_EQ(found.first->tick, 42u);
  EXPECT_EQ(found.first->line, 43u) << "the first is the header";
  EXPECT_GT(found.largest_n, 0);
  EXPECT_NE(found.text().find("1 differ"), std::string::npos);
}

TEST(Conversation, NoticesAStiffnessThatDiffersOrIsGone) {
  const std::string text = conversation(engine(500), 10);
  const Replay found = replayed(text, [same = engine(500)](const DeviceState& hand) {
    Touch touch = same(hand);
    touch.stiffness.reset();
    return touch;
  });
  EXPECT_EQ(found.differing, 5u);
  EXPECT_EQ(found.largest_n, 0);
  EXPECT_NE(found.text().find("only the rest of the answer differs"), std::string::npos);
}

TEST(Conversation, KeepsAllThatAnAnswerMayBringAndNoticesEachThatDiffers) {
  Touch all(Vec3(-1, 0.1, 0));
  all.stiffness = Mat3(Vec3(500, 0, 0).asDiagonal());
  all.valid_radius = 0.003;
  all.contact = Contact{.normal = Vec3(-1, 0, 0), .gap = -0.002, .table = ForceTable{}};
  all.contact->table->first = -0.001;
  all.contact->table->step = 0.0005;
  all.contact->table->size = 3;
  all.contact->table->force = {0.1, 0.2, 0.4};
  all.topology_changed = true;
  all.error = 0.01;
  const std::string text = conversation([&](const DeviceState&) { return all; }, 2);
  EXPECT_EQ(replayed(text, [&](const DeviceState&) { return all; }).differing, 0u);
  const std::vector<std::function<void(Touch&)>> changes = {
      [](Touch& touch) { touch.stiffness.reset(); },
      [](Touch& touch) { touch.valid_radius = 0.004; },
      [](Touch& touch) { touch.valid_radius = Touch{}.valid_radius; },
      [](Touch& touch) { touch.contact.reset(); },
      [](Touch& touch) { touch.contact->normal.y() = 1e-300; },
      [](Touch& touch) { touch.contact->gap = 0; },
      [](Touch& touch) { touch.contact->table.reset(); },
      [](Touch& touch) { touch.contact->table->first = 0; },
      [](Touch& touch) { touch.contact->table->step = 0.001; },
      [](Touch& touch) { touch.contact->table->size = 2; },
      [](Touch& touch) { touch.contact->table->force[2] = 0.5; },
      [](Touch& touch) { touch.topology_changed = false; },
      [](Touch& touch) { touch.error.reset(); },
      [](Touch& touch) { touch.error = 0.02; }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Touch other = all;
    changes[i](other);
    EXPECT_EQ(replayed(text, [&](const DeviceState&) { return other; }).differing, 2u) << "change " << i;
  }
}

TEST(Conversation, TakesANanForANan) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto text = conversation([&](const DeviceState&) { return Touch(Vec3(nan, 0, 0)); }, 3);
  EXPECT_EQ(replayed(text, [&](const DeviceState&) { return Touch(Vec3(-nan, 0, 0)); }).differing, 0u);
  EXPECT_EQ(replayed(text, [&](const DeviceState&) { return Touch(Vec3(0, nan, 0)); }).differing, 3u);
}

TEST(Conversation, AnswersAsTheEngineDoesAndPassesOnWhatItThrows) {
  std::ostringstream file;
  const Physics wrapped = recorded(engine(500), file);
  EXPECT_EQ(wrapped(odd_state(2)).force, engine(500)(odd_state(2)).force);
  const auto before = file.str();
  const Physics breaks = recorded([](const DeviceState&) -> Touch { throw std::runtime_error("broken"); }, file);
  const auto header = file.str();
  EXPECT_THROW(breaks(odd_state(3)), std::runtime_error);
  EXPECT_EQ(file.str(), header) << "no line without an answer";
}

TEST(Conversation, GoesOnWhenTheFileTakesNoMore) {
  std::ostringstream file;
  const Physics wrapped = recorded(engine(500), file);
  file.setstate(std::ios::badbit);
  EXPECT_TRUE(wrapped(odd_state(1)).force.allFinite());
}

TEST(Conversation, ThatIsNoneIsRefusedWithItsLine) {
  const std::string good = conversation(engine(500), 3);
  const auto says = [&](const std::string& text) {
    return thrown_by<std::runtime_error>([&] { replayed(text, engine(500)); });
  };
  EXPECT_EQ(says(good), "");
  EXPECT_EQ(says(""), "line 1: expected \"tendon conversation 1\", got \"\"");
  EXPECT_EQ(says("tendon conversation 2\n"),
            "line 1: expected \"tendon conversation 1\", got \"tendon conversation 2\"");
  EXPECT_EQ(says(good + "1 2 3\n"), "line 5: it ends after 3 words");
  const std::string whole = good.substr(0, good.size() - 1);
  EXPECT_EQ(says(whole + " cut stiffness\n"), "line 4: \"stiffness\" is not expected in an answer here");
  EXPECT_EQ(says(whole + " error\n"), "line 4: it ends after 23 words");
  EXPECT_EQ(says(whole + " contact 1p+0 0p+0 0p+0 0p+0 table 0p+0 1p+0 17\n"),
            "line 4: expected a table of at most 16 entries, got 17");
  EXPECT_EQ(says(good.substr(0, good.size() - 1)), "line 4: truncated");
  std::string wrong = good;
  wrong.replace(wrong.find('\n') + 1, 1, "x");
  EXPECT_EQ(says(wrong), "line 2: \"x\" is not a valid number");
}

}  // namespace
}  // namespace tendon::conversation_test
