// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/frames.h"
#include "devices/replay/replay_device.h"
#include "server/mailboxes.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::scene_device_test {
namespace {

using namespace std::chrono_literals;
using testing::ScratchFolder;

constexpr std::string_view kFalcon =
    "[device]\n"
    "kind = \"falcon\"\n"
    "[limiter]\n"
    "coulomb_friction_n = 0.9\n"
    "viscous_friction_n_s_per_m = 0\n";

TEST(Scene, TheAxesOfEachKindOfDeviceAreKnownOrASceneSaysThem) {
  for (const Driver* driver : drivers()) {
    EXPECT_EQ(driver->axes.empty(), driver->kind == "replay") << driver->kind;
    if (driver->axes.empty()) continue;
    EXPECT_EQ(axes_in_words(operator_from_device(driver->axes)), driver->axes);
  }
  EXPECT_EQ(parse(std::string(kFalcon), "/scenes").axes, "");
  const std::string head = "[device]\naxes = ";
  const std::string rest = std::string(kFalcon.substr(kFalcon.find('\n')));
  EXPECT_EQ(parse(head + "\"user=-x up=z right=-y\"" + rest, "/scenes").axes, "right=-y up=z user=-x");
}

TEST(Scene, AxesThatMakeNoRotationAreRefusedWithTheReason) {
  const auto refusal = [](const std::string& axes) {
    return thrown_by<SceneError>(
        [&] { parse("[device]\naxes = " + axes + std::string(kFalcon.substr(kFalcon.find('\n'))), "/scenes"); });
  };
  const std::string expected =
      "s.toml:2: device.axes: expected the axes that point to the operator's right, up and towards the user, like "
      "\"right=x up=y user=z\"";
  EXPECT_EQ(refusal("\"right=x up=y user=-z\""),
            expected + " (these three axes form a left-handed frame), found \"right=x up=y user=-z\"");
  EXPECT_EQ(refusal("1"), expected + ", found 1");
}

TEST(Scene, ADeviceSaysItsGroupAndTheHandThatHoldsIt) {
  const auto scene_of = [](const std::string& keys) {
    return parse("[device]\n" + keys + std::string(kFalcon.substr(kFalcon.find('\n'))), "/scenes");
  };
  EXPECT_EQ(scene_of("").group, "");
  EXPECT_EQ(scene_of("").hand, Hand::kAny);
  EXPECT_EQ(scene_of("group = \"surgeon\"").group, "surgeon");
  EXPECT_EQ(scene_of("held_by = \"left\"").hand, Hand::kLeft);
  EXPECT_EQ(scene_of("held_by = \"right\"").hand, Hand::kRight);
  const auto refusal = [&](const std::string& keys) { return thrown_by<SceneError>([&] { scene_of(keys); }); };
  EXPECT_EQ(refusal("held_by = \"both\""),
            "s.toml:2: device.held_by: expected one of \"any\", \"left\", \"right\", found \"both\"");
  EXPECT_EQ(refusal("held_by = 1"), "s.toml:2: device.held_by: expected one of \"any\", \"left\", \"right\", found 1");
  EXPECT_EQ(refusal("group = \"two arms\""),
            "s.toml:2: device.group: expected a name of 1 to 24 letters, digits, - or _, found \"two arms\"");
}

TEST(Scene, AFalconIsARealDeviceWhoseFrictionIsToldNotTaken) {
  const Scene scene = parse(std::string(kFalcon), "/scenes");
  ASSERT_TRUE(std::holds_alternative<falcon::Config>(scene.device));
  EXPECT_EQ(std::get<falcon::Config>(scene.device).port, "");
  EXPECT_FALSE(std::get<falcon::Config>(scene.device).firmware ||
               std::get<falcon::Config>(scene.device).accept_unknown_firmware);
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, 0.9) << "nobody here knows that it has less";
  EXPECT_EQ(scene.loop.control.max_force, 8);
  EXPECT_EQ(scene.loop.control.watchdog, 0ns);
  EXPECT_FALSE(std::holds_alternative<falcon::Config>(parse(std::string(kMinimal)).device));

  const std::string keys =
      "port = \"1-2.3\"\nfirmware = \"mine.bin\"\naccept_unknown_firmware = true\nname = \"left\"\n";
  const Scene told =
      parse("[device]\nkind = \"falcon\"\n" + keys + std::string(kFalcon.substr(kFalcon.find("[l"))), "/scenes");
  const auto& config = std::get<falcon::Config>(told.device);
  EXPECT_EQ(config.port, "1-2.3");
  EXPECT_EQ(config.firmware, "/scenes/mine.bin");
  EXPECT_TRUE(config.accept_unknown_firmware);
  EXPECT_EQ(told.name, "left");
  EXPECT_TRUE(std::holds_alternative<falcon::Config>(shipped("falcon.toml").device));
}

TEST(Scene, AFalconHasNoKeysOfTheSimulatedDeviceAndIsNotWithoutALimiter) {
  const std::string falcon = "[device]\nkind = \"falcon\"\n";
  EXPECT_EQ(error_of(falcon + "profile = \"falcon\"\n"),
            "s.toml:3: device.profile: unknown key; expected one of kind, name, count, axes, group, held_by, port, "
            "firmware, accept_unknown_firmware");
  EXPECT_EQ(error_of(falcon + "port = \"left\"\n"),
            "s.toml:3: device.port: expected a port from `tendond devices`, like \"1-2.3\", found \"left\"");
  EXPECT_EQ(error_of(falcon + "[limiter]\nkind = \"none\"\n"),
            "s.toml:4: limiter.kind: expected a limiter, found \"none\", which is for simulated devices only");
  EXPECT_EQ(error_of(falcon + "[limiter]\nviscous_friction_n_s_per_m = 0\n"),
            "s.toml:3: limiter.coulomb_friction_n: missing, expected a number of 0 N or more: use the value from "
            "tendon-identify for this device, or 0");
}

TEST(Scene, AFalconAlwaysHasToBeArmed) {
  const Scene scene = parse(std::string(kFalcon));
  ASSERT_TRUE(scene.safety);
  EXPECT_EQ(scene.safety->arming.by, SafeDevice::Arming::By::kRequest);
  EXPECT_EQ(parse(std::string(kFalcon) + "[safety.dead_man]\nbutton = 3\n").safety->dead_man->button, 3U);
  EXPECT_EQ(error_of(std::string(kFalcon) + "[safety.dead_man]\nbutton = 4\n"),
            "s.toml:7: safety.dead_man.button: expected 0 to 3, a button of the Falcon, found 4");
}

constexpr std::string_view kReplay = "[device]\nkind = \"replay\"\n";

TEST(Scene, AReplayedCsvFileNeedsNothingElseBecauseNobodyFeelsAForce) {
  const ScratchFolder folder;
  write(folder.path() / "hand.csv", "t_s,angle\n10,0\n10.01,2\n10.015,4\n");
  const Scene scene = parse(std::string(kReplay) +
                                "at_end = \"repeat\"\nencoder_step_um = 30\n[device.csv]\nfile = \"hand.csv\"\n"
                                "position_column = \"angle\"\nscale_m = 0.5\ndirection = [0, 3, 0]\n",
                            folder.path());
  EXPECT_FALSE(scene.driver().exerts_force);
  const auto& replay = std::get<ReplayDevice::Config>(scene.device);
  ASSERT_EQ(replay.samples.size(), 3U);
  EXPECT_EQ(replay.samples[2].position, Vec3(0, 2, 0));
  EXPECT_EQ(replay.samples[2].at - replay.samples[0].at, 15ms);
  EXPECT_EQ(replay.at_end, ReplayDevice::AtEnd::kRepeat);
  EXPECT_EQ(replay.position_resolution, 3e-5);
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, 0);
  EXPECT_TRUE(parse(std::string(kMinimal)).driver().exerts_force);
}

TEST(Scene, AReplayedRecordingIsTheHandThatWasSeenBitForBit) {
  const ScratchFolder folder;
  const auto path = folder.path() / "run.mcap";
  std::vector<StepRecord> steps(40);
  {
    FileSink sink(path);
    Recorder recorder({.scene = {}, .started = LocalTime(1s)}, sink);
    for (int i = 0; StepRecord & step : steps) {
      const double x = std::sin(0.1 * i);
      step.hand = {.at = LocalTime(1s + i * 1ms + i % 3 * 7us), .position = {x, x / 3, -x}, .velocity = Vec3::Zero()};
      if (i++ % 5 == 4) step.reasons |= Reason::kUnseen;
      recorder.record(step, 0);
    }
    recorder.close();
  }
  const Scene scene = parse(std::string(kReplay) + "recording = \"run.mcap\"\n", folder.path());
  std::erase_if(steps, [](const StepRecord& step) { return step.reasons.has(Reason::kUnseen); });
  const auto& replay = std::get<ReplayDevice::Config>(scene.device);
  ASSERT_EQ(replay.samples.size(), steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    EXPECT_EQ(replay.samples[i].position, steps[i].hand.position);
    EXPECT_EQ(replay.samples[i].at, steps[i].hand.at.time_since_epoch());
  }
}

TEST(Scene, AReplayNamesItsSourceAndWhatIsWrongWithIt) {
  const ScratchFolder folder;
  const auto error = [&folder](const std::string& more) {
    return thrown_by<SceneError>([&] { parse(std::string(kReplay) + more, folder.path()); });
  };
  const std::string csv = "[device.csv]\nfile = \"hand.csv\"\nposition_column = \"x\"\n";
  EXPECT_EQ(error(""), "s.toml:1: device: expected either recording or a table csv, found neither");
  EXPECT_EQ(error("recording = \"a.mcap\"\n" + csv),
            "s.toml:1: device: expected either recording or a table csv, found both");
  EXPECT_NE(error("recording = \"a.mcap\"\n").find("s.toml:3: device.recording: "), std::string::npos);
  EXPECT_NE(error(csv).find("s.toml:4: device.csv.file: "), std::string::npos) << error(csv);
  write(folder.path() / "hand.csv", "t_s,x\n0,0\n0.01,1\n0.05,2\n");
  EXPECT_EQ(error(csv),
            "s.toml:4: device.csv.file: expected samples no further apart than 19 ms, because a device that is silent "
            "for longer is a fault, found 40 ms at 0.01 s");
  write(folder.path() / "hand.csv", "t_s,x\n0,0\n0.01,1\n");
  EXPECT_EQ(error(csv), "");
  EXPECT_NE(error(csv + "direction = [0, 0, 0]\n").find("replay.direction (its length)"), std::string::npos);
}

TEST(Scene, AReplayRunsTheLoopAsTheHandDidAndAFieldOfForceChangesNothing) {
  const ScratchFolder folder;
  write(folder.path() / "hand.csv", "t_s,x\n0,0\n0.002,0.001\n0.004,0.002\n0.006,0.003\n");
  const Scene scene =
      parse(std::string(kReplay) + "[device.csv]\nfile = \"hand.csv\"\nposition_column = \"x\"\n", folder.path());
  const auto& replay = std::get<ReplayDevice::Config>(scene.device);
  ReplayDevice device(replay);
  Mailboxes mail({.steps = 64, .flight = 2, .datagrams = 1});
  HapticLoop loop(scene.loop, device, mail);
  LocalTime now{1s};
  double asked = 0;
  for (int i = 0; i < 12; ++i, now += 1ms) {
    RemoteForce force;
    force.sequence = static_cast<std::uint64_t>(i + 1);
    force.received = force.answers = now;
    force.force = {-3, 0, 0};
    force.valid_for = 20ms;
    mail.forces[0].put(force);
    loop.step(now);
    const StepRecord* step = mail.steps.front();
    EXPECT_EQ(step->applied, Vec3::Zero());
    asked = std::max(asked, step->wanted.norm());
    if (i % 2 == 0 && i <= 6) {
      EXPECT_EQ(step->hand.position, replay.samples[static_cast<std::size_t>(i / 2)].position);
    }
    mail.steps.pop();
  }
  EXPECT_GT(asked, 0);
  EXPECT_EQ(loop.stats().fault, HapticController::Fault::kNone);
}

TEST(Scene, ASpaceMouseNeedsNothingElseEither) {
  const std::string mouse = "[device]\nkind = \"spacemouse\"\n";
  const Scene plain = parse(mouse);
  ASSERT_TRUE(std::holds_alternative<spacemouse::Config>(plain.device));
  EXPECT_FALSE(plain.driver().exerts_force);
  const Scene told = parse(mouse + "port = \"1-2.3\"\nspeed_m_per_s = 0.3\ndead_band = 0.2\nreach_mm = 70\n");
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).port, "1-2.3");
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).motion.speed, 0.3);
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).motion.dead_band, 0.2);
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).motion.reach, 0.07);
  EXPECT_EQ(error_of(mouse + "dead_band = 1\n"),
            "s.toml:3: device.dead_band: expected a number from 0 to 0.9, found 1");
  EXPECT_TRUE(std::holds_alternative<spacemouse::Config>(shipped("spacemouse.toml").device));
}

constexpr std::string_view kArm =
    "[device]\n"
    "kind = \"woodenhaptics\"\n"
    "model = \"polhem_v1\"\n";
constexpr std::string_view kArmsFriction =
    "[limiter]\n"
    "coulomb_friction_n = 0.9\n"
    "viscous_friction_n_s_per_m = 0\n";

TEST(Scene, AWoodenHapticsIsARealDeviceOfAModelWhoseWatchdogIsCountedOn) {
  const Scene scene = parse(std::string(kArm) + std::string(kArmsFriction));
  ASSERT_TRUE(std::holds_alternative<woodenhaptics::Config>(scene.device));
  EXPECT_TRUE(scene.driver().moves_a_hand);
  EXPECT_TRUE(scene.driver().exerts_force);
  EXPECT_EQ(std::get<woodenhaptics::Config>(scene.device).drive.model, woodenhaptics::find_model("polhem_v1"));
  EXPECT_EQ(std::get<woodenhaptics::Config>(scene.device).drive.max_current, 2);
  EXPECT_EQ(std::get<woodenhaptics::Config>(scene.device).port, "");
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, 0.9) << "nobody here knows that it has less";
  EXPECT_EQ(scene.loop.control.max_force, 5);
  EXPECT_EQ(scene.loop.control.watchdog, 500ms);
  EXPECT_EQ(
      scene.simulated().encoder_step,
      WoodenHapticsDevice::info_of(*std::get<woodenhaptics::Config>(scene.device).drive.model).position_resolution);
  ASSERT_TRUE(scene.safety) << "it always has to be armed";
  EXPECT_EQ(scene.safety->arming.by, SafeDevice::Arming::By::kRequest);

  const Scene told = parse(std::string(kArm) + "port = \"1-2.3\"\nmax_current_ma = 700\n" + std::string(kArmsFriction));
  EXPECT_EQ(std::get<woodenhaptics::Config>(told.device).port, "1-2.3");
  EXPECT_EQ(std::get<woodenhaptics::Config>(told.device).drive.max_current, 0.7);
  EXPECT_FALSE(std::holds_alternative<woodenhaptics::Config>(parse(std::string(kFalcon)).device));
  EXPECT_TRUE(std::holds_alternative<woodenhaptics::Config>(shipped("woodenhaptics.toml").device));
}

TEST(Scene, AWoodenHapticsSaysWhichModelsCanBeDrivenAndWhyTwoCannot) {
  const std::string kind = "[device]\nkind = \"woodenhaptics\"\n";
  const std::string models =
      "expected one of \"woodenhaptics_v2019\", \"woodenhaptics_v2015\", \"polhem_v1\", \"aluhaptics_v2\", \"vintage\"";
  EXPECT_EQ(error_of(kind), "s.toml:1: device.model: missing, " + models);
  EXPECT_EQ(error_of(kind + "model = \"hawk\"\n"), "s.toml:3: device.model: " + models + ", found \"hawk\"");
  for (const std::string name : {"polhem_v2", "polhem_v3"}) {
    EXPECT_EQ(error_of(kind + "model = \"" + name + "\"\n"),
              "s.toml:3: device.model: " + models +
                  " (Polhem v2 and v3 have a closed linkage, and their kinematics are not published), found \"" + name +
                  "\"");
  }
  EXPECT_EQ(error_of(std::string(kArm) + "max_current_ma = 4000\n" + std::string(kArmsFriction)),
            "s.toml:4: device.max_current_ma: expected at most 3000 mA, the full scale of its amplifiers, found 4000");
  EXPECT_EQ(error_of(std::string(kArm) + "max_current_ma = 0\n"),
            "s.toml:4: device.max_current_ma: expected a number from 1 to 6000 mA, found 0");
  EXPECT_EQ(error_of(std::string(kArm) + "[limiter]\nkind = \"none\"\n"),
            "s.toml:5: limiter.kind: expected a limiter, found \"none\", which is for simulated devices only");
  EXPECT_EQ(error_of(std::string(kArm) + std::string(kArmsFriction) + "[safety.dead_man]\nbutton = 1\n"),
            "s.toml:8: safety.dead_man.button: expected 0, the switch at its tip, found 1");
}

TEST(SceneDevice, HasTheWallsAndTheMediumThatItsTableLists) {
  EXPECT_FALSE(minimal_and("").simulated().environment);
  const auto environment = *minimal_and(R"([device.environment]
damping_n_s_per_m = 2
friction_n = 0.5
[[device.environment.wall]]
point_mm = [8, 0, 1]
normal = [-1, 0, 0]
stiffness_n_per_m = 2000
damping_n_s_per_m = 3
friction = 0.4
speed_m_per_s = -0.02
from_ms = 100
until_ms = 5000
[[device.environment.wall]]
normal = [0, 0, 2]
stiffness_n_per_m = 500
)")
                                .simulated()
                                .environment;
  EXPECT_EQ(environment.damping, 2);
  EXPECT_EQ(environment.friction, 0.5);
  ASSERT_EQ(environment.walls.size(), 2U);
  const auto& wall = environment.walls[0];
  EXPECT_EQ(wall.point, Vec3(0.008, 0, 0.001));
  EXPECT_EQ(wall.normal, Vec3(-1, 0, 0));
  EXPECT_EQ(wall.stiffness, 2000);
  EXPECT_EQ(wall.damping, 3);
  EXPECT_EQ(wall.friction, 0.4);
  EXPECT_EQ(wall.speed, -0.02);
  EXPECT_EQ(wall.from, 100ms);
  EXPECT_EQ(wall.until, 5s);
  EXPECT_FALSE(environment.walls[1].until);
  EXPECT_EQ(error_of_minimal_and("[[device.environment.wall]]\nnormal = [0, 0, 0]\nstiffness_n_per_m = 500\n"),
            "s.toml:1: device: environment.wall.normal = 0: expected a length above 0");
}

}  // namespace
}  // namespace tendon::scene_device_test
