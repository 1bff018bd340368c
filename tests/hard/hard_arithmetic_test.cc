// SPDX-License-Identifier: Apache-2.0
// Tests rounding, compiler optimizations, denormals, and NaN.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "clients/softbody/placed_body.h"
#include "core/base/arithmetic.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/robust_ledger.h"
#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "protocol/wire/codec.h"
#include "server/haptic_loop.h"
#include "tests/clients/softbody/scene_text.h"
#include "tests/hard/row.h"
#include "tests/tools/worlds/world.h"

namespace tendon::hard_arithmetic_test {
namespace {

using hard::report;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Vec1 = Eigen::Matrix<double, 1, 1>;

std::string text(double value) {
  std::ostringstream out;
  out.precision(2);
  out << value;
  return out.str();
}

// Oracle: 1e8 times the double next to 1e-6 is exactly 100.
TEST(HardArithmetic, AHundredMillionStepsOfTheLedgerAddUpToTheLastBit) {
  constexpr int kSteps = 100'000'000;
  EnergyLedger ledger({0, 0});
  RobustLedger<1> robust({});
  double plain = 0;
  float single = 0;
  for (int i = 0; i < kSteps; ++i) {  // 1 µJ
    ledger.observe(Vec1(-1e-3), Vec1(1e-3), milliseconds(1));
    plain += 1e-6;
    single += 1e-6F;
  }
  for (int i = 0; i < kSteps / 10; ++i) {
    robust.observe({.applied = Vec1(-1e-2), .dx = Vec1(1e-3), .held = milliseconds(1)});  // 10 µJ
  }
  const double last_bit = std::nextafter(100.0, 200.0) - 100;
  const double error = std::max(std::abs(ledger.energy() - 100), std::abs(robust.energy() - 100));
  EXPECT_LE(error, 2 * last_bit);
  EXPECT_GT(std::abs(plain - 100), 1e-8);
  report(
      {.hard = "rounding errors of 1e8 steps (28 hours at 1 kHz) accumulate",
       .oracle = "1e8 times 1 µJ is 100 J within two of the last bits, in the ledgers of AOL and AOL+",
       .result = text(error) + " J off",
       .margin = error > 0 ? std::optional(2 * last_bit / error) : std::nullopt,
       .without = "a plain double: " + text(std::abs(plain - 100)) + " J off; a float ends at " + text(single) + " J"});
}

std::pair<int, std::string> run(const std::string& command) {
  std::pair<int, std::string> result;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> part{};
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), pipe))
    result.second.append(part.data(), size);
  result.first = pclose(pipe);
  return result;
}

// Oracle: the compiler itself, which is run on the sources that detect NaN or compensate rounding.
TEST(HardArithmetic, FastMathStopsTheBuildOfEveryRoomThatCatchesNaN) {
  const std::string sentence = "Tendon is not built with -ffast-math";
  const std::string preprocess =
      TENDON_COMPILER " -std=c++20 -Wfatal-errors -E -o /dev/null -I" TENDON_SOURCES " " TENDON_INCLUDES " ";
  const auto [status, said] = run(preprocess + "-O2 -x c++ " TENDON_SOURCES "/core/base/arithmetic.h");
  EXPECT_EQ(status, 0) << said;
  int stopped = 0;
  for (const std::string flag : {"-ffast-math", "-Ofast", "-O2 -ffinite-math-only"}) {
    const auto [failed, why] = run(preprocess + flag + " -x c++ " TENDON_SOURCES "/core/base/arithmetic.h");
    EXPECT_NE(failed, 0) << flag;
    EXPECT_NE(why.find(sentence), std::string::npos) << why;
    stopped += failed != 0 ? 1 : 0;
  }
  const std::vector<std::string> files = {
      "core/ledger/energy_ledger.cc",     "core/ledger/robust_ledger.cc", "protocol/wire/bounds.h",
      "protocol/wire/fields/reader.h",    "server/haptic_loop.cc",        "clients/cpp/force_client.cc",
      "clients/softbody/touch/contact.cc"};
  for (const std::string& file : files) {
    const auto [failed, why] = run(preprocess + "-ffast-math -x c++ " TENDON_SOURCES "/" + file);
    EXPECT_NE(failed, 0) << file;
    EXPECT_NE(why.find(sentence), std::string::npos) << file << '\n' << why;
  }
  report({.hard = "with -ffast-math, isfinite(NaN) is true and rounding errors are not compensated",
          .oracle =
              "-ffast-math, -Ofast and -ffinite-math-only cause an error message in core, protocol, server and clients",
          .result = std::to_string(stopped) + " flags, " + std::to_string(files.size()) + " files",
          .without = "the #error left out: everything compiles"});
}

/// A device whose library reads the thread's floating-point mode and changes it without restoring it.
class CarelessDevice final : public Device {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    note();
    return PositionSample{.at = now, .position = Vec3::Zero()};
  }
  Vec3 apply(const Vec3& force) noexcept override {
    note();
    DenormalsOff::set_mode(DenormalsOff::mode() & ~DenormalsOff::kFlush);
    return force;
  }
  int calls = 0;
  int flushed = 0;

 private:
  void note() noexcept {
    const volatile double tiny = std::numeric_limits<double>::denorm_min();
    const volatile double least = std::numeric_limits<double>::min();
    const bool set = (DenormalsOff::mode() & DenormalsOff::kFlush) == DenormalsOff::kFlush;
    ++calls;
    flushed += set && tiny * 0x1p60 == 0 && least * 0.5 == 0 ? 1 : 0;
  }
  DeviceInfo info_{.name = "careless", .max_force = 5, .position_resolution = 0, .watchdog = {}};
};

bool slow(double value) { return std::fpclassify(value) == FP_SUBNORMAL; }

// Oracle: the mode register of the processor. In addition, numbers below 2.2e-308 must be 0 during a step.
TEST(HardArithmetic, DenormalsAreOffInHapticStepsAndSoftBodyAnswers) {
  if (DenormalsOff::kFlush == 0) GTEST_SKIP() << "this processor's mode is not known to DenormalsOff";
  CarelessDevice device;
  HapticLoop::Config config;
  config.control.limiter.friction = {0.3, 0.8};
  config.control.limiter.longest_hold = milliseconds(2);
  config.control.max_force = 5;
  config.control.max_slew = 1000;
  const auto mail = std::make_unique<Mailboxes>();
  HapticLoop loop(config, device, *mail);
  const auto before = DenormalsOff::mode();
  LocalTime now(seconds(1));
  for (int i = 0; i < 100; ++i) now = loop.step(now);
  EXPECT_EQ(DenormalsOff::mode(), before);
  EXPECT_EQ(device.calls, 200);
  EXPECT_EQ(device.flushed, 200);

  // The oscillation of the block decays until the force is less than 1e-308.
  std::string scene = softbody::testing::with("\"condensed\"", "\"linear\"");
  const auto put = [&](std::string_view old, std::string_view by) { scene.replace(scene.find(old), old.size(), by); };
  put("[\"contact\"]", "[\"contact\", \"inertia\", \"damping\"]\nstep_ms = 2\ndamping_per_s = 60");
  put("hex8-sri", "tet4");
  put("[4, 4, 2]", "[2, 2, 1]");
  put("poisson", "density_kg_per_m3 = 1000, poisson");
  put("patch_radius_mm = 20", "patch_radius_mm = 20\nside = \"bilateral\"");
  put("at_mm = [10, 0, 0]\ntowards_hand = [-1, 0, 0]", "at_mm = [0, 0, 0]\ntowards_hand = [0, 0, 1]");
  const auto place = [](int i) { return Vec3(0, 0, i < 50 ? -1e-3 : 0); };
  constexpr int kAnswers = 20'000;
  softbody::PlacedBody careful(softbody::parse_scene(scene, "s.toml", "."));
  softbody::PlacedBody careless(softbody::parse_scene(scene, "s.toml", "."));
  int slow_answers = 0;
  int slow_without = 0;
  DeviceState hand;
  for (int i = 0; i < kAnswers; ++i) {
    hand.sampled = PeerTime(milliseconds(2 * i));
    hand.position = place(i);
    slow_answers += slow(careful.answer(hand).force.z()) ? 1 : 0;
    slow_without += slow(careless.touch(place(i)).force.z()) ? 1 : 0;
  }
  EXPECT_EQ(slow_answers, 0);
  EXPECT_GT(slow_without, 0);
  report(
      {.hard = "a decaying force becomes a denormal number, with which x86-64 is some hundred times slower",
       .oracle =
           "denormals are 0 in all haptic steps, even if a driver changes the mode, and in all answers of a soft body",
       .result = std::to_string(device.flushed) + " of " + std::to_string(device.calls) + " calls; " +
                 std::to_string(slow_answers) + " of " + std::to_string(kAnswers) + " answers",
       .without = "DenormalsOff left out: " + std::to_string(slow_without) + " answers"});
}

/// Simulates a tool that is pressed into a soft block with a bad network. If there are two simulations with the same
/// seed, they are bitwise identical until a datagram is inserted into one of them.
struct Twin {
  explicit Twin(std::uint64_t seed)
      : device(hand()), world(config(seed), device), body(softbody::parse_scene(scene(), "s.toml", ".")) {
    world.watch_steps([this](const StepRecord& step) {
      note(step.hand.position);
      note(step.force);
      note(step.applied);
      note(Vec3(step.energy, step.permitted, 0));
    });
    client = world.add_controller({.name = "Z", .rate_hz = 100}, [this](const DeviceState& state) {
      const Touch touch = body.answer(state);
      note(state.position);
      note(touch.force);
      return touch;
    });
    world.run_for(seconds(2));
  }

  static SimulatedDevice::Config hand() {
    SimulatedDevice::Config device = find_device_profile("falcon")->device();
    device.hand = OperatorHand::Config{
        .stiffness = 300,
        .damping = 3,
        .mass = 0.05,
        .motion = ScriptedMotion(ScriptedMotion::RampHold{
            .from = Vec3(0, 0, 0), .to = Vec3(0.02, 0, 0), .ramp = milliseconds(800), .hold = std::nullopt})};
    return device;
  }
  simulation::World::Config config(std::uint64_t seed) const {
    simulation::World::Config config;
    config.seed = seed;
    config.loop.control.limiter.friction = {0.3, 0.8};
    config.loop.control.limiter.longest_hold = milliseconds(2);
    config.loop.control.max_force = device.info().max_force;
    config.loop.control.max_slew = 1000;
    return config;
  }
  static std::string scene() {
    std::string scene = softbody::testing::with("\"condensed\"", "\"linear\"");
    const std::string_view effects = "[\"contact\"]";
    scene.replace(scene.find(effects), effects.size(),
                  "[\"contact\", \"inertia\", \"damping\"]\nstep_ms = 2\ndamping_per_s = 40");
    scene.replace(scene.find("poisson"), 7, "density_kg_per_m3 = 1000, poisson");
    return scene;
  }

  void note(const Vec3& vector) {
    for (const double number : vector) bits.push_back(std::bit_cast<std::uint64_t>(number));
  }

  /// Inserts a forged datagram with the sender's next packet number, with or without a frame.
  template <class Frame>
  void forge(bool to_server, std::uint64_t number, const std::optional<Frame>& frame) {
    std::array<std::byte, kMaxDatagram> buffer{};
    DataWriter writer;
    writer.begin(buffer, {.connection_id = 1, .packet_number = number}, world.now(), std::nullopt);
    if (frame) writer.add(*frame);
    const Address from = to_server ? world.client_address(client) : world.server_address();
    const Address to = to_server ? world.server_address() : world.client_address(client);
    world.network().forge(from, to, std::span<const std::byte>(buffer).first(writer.size()));
  }

  SimulatedDevice device;
  simulation::World world;
  softbody::PlacedBody body;
  std::size_t client = 0;
  std::vector<std::uint64_t> bits;
};

// Oracle: a twin that receives a datagram without a frame at the time when the other receives the invalid frame. All
// values at the device, the hand and the engine must be bitwise identical.
TEST(HardArithmetic, NaNIsCountedAndLeavesServerAndEngineAsTheyWere) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const std::array bad = {std::nan(""), -std::nan(""), kInf, -kInf, 1e300, -1e300, 1.1e12};
  std::uint64_t refused = 0;
  std::size_t compared = 0;
  for (const std::uint64_t seed : {7U, 8U}) {
    Twin spoilt(seed);
    Twin whole(seed);
    ASSERT_EQ(spoilt.bits, whole.bits);
    for (Twin* twin : {&spoilt, &whole}) {
      std::uint64_t up = twin->world.client(twin->client).stats().link.datagrams_sent;
      std::uint64_t down = twin->world.server().stats().controller.datagrams_sent;
      for (const double value : bad) {
        std::optional<ForceCommand> command(std::in_place);
        command->sequence = 1'000'000;
        command->based_on_tick = 2000;
        command->force = Vec3(0, value, 0);
        command->valid_for = milliseconds(30);
        std::optional<DeviceState> state(std::in_place);
        state->tick = 1'000'000;
        state->sampled = PeerTime(twin->world.now().time_since_epoch());
        state->position = Vec3(0, 0, value);
        state->mode = Mode::kActive;
        if (twin == &whole) {
          command.reset();
          state.reset();
        }
        twin->forge(true, up++, command);
        twin->forge(false, down++, state);
      }
      twin->world.run_for(seconds(1));
    }
    EXPECT_EQ(spoilt.bits, whole.bits) << "seed " << seed;
    const auto by_server = spoilt.world.server().stats().controller.invalid;
    const auto by_engine = spoilt.world.client(spoilt.client).stats().link.invalid;
    const auto more_by_server = by_server - whole.world.server().stats().controller.invalid;
    const auto more_by_engine = by_engine - whole.world.client(whole.client).stats().link.invalid;
    EXPECT_EQ(more_by_server, bad.size());
    EXPECT_EQ(more_by_engine, bad.size());
    EXPECT_EQ(spoilt.world.client(spoilt.client).phase(), ForceClient::Phase::kOpen);
    refused += more_by_server + more_by_engine;
    compared += spoilt.bits.size();

    const auto before = spoilt.world.server().stats().controller;
    ForceCommand command;
    command.sequence = 1'000'001;
    command.based_on_tick = 3000;
    command.force = Vec3::Constant(std::numeric_limits<double>::denorm_min());
    command.valid_for = milliseconds(30);
    spoilt.forge(true, spoilt.world.client(spoilt.client).stats().link.datagrams_sent, std::optional(command));
    spoilt.bits.clear();
    spoilt.world.run_for(milliseconds(20));
    EXPECT_EQ(spoilt.world.server().stats().controller.invalid, before.invalid);
    for (const std::uint64_t number : spoilt.bits) EXPECT_TRUE(std::isfinite(std::bit_cast<double>(number)));
  }
  report({.hard = "NaN, Inf or 1e300 in a message stays in a filter or a mesh for ever",
          .oracle = "each is counted; 1 s later all numbers are equal to those of a twin without them, to the last bit",
          .result = std::to_string(refused) + " refused, " + std::to_string(compared) + " numbers equal",
          .without = "the codec's bound left out: the twins part"});
}

}  // namespace
}  // namespace tendon::hard_arithmetic_test
