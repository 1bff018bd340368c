// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/situations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "core/base/expect.h"
#include "core/base/nearest_word.h"
#include "core/base/portable_math.h"
#include "server/tables/recorded_motion.h"
#include "tests/support/dice.h"
#include "tests/tools/lab/experiments/paper.h"

namespace tendon::lab {
namespace {

struct Draft {
  Dice& dice;
  Trial trial;
  FreeHand hand;
  double amplitude = 0.015;  // m
  double frequency = 0.5;    // Hz
  double k = 0;              // N/m

  void say(const std::string& name, double value, const char* unit) {
    trial.drawn += (trial.drawn.empty() ? "" : " ") + name + "=" + shortest(value) + unit;
  }
  void object(Environment::Force force) { trial.experiment.environment.force = std::move(force); }
  /// An object with state depends on the sequence of queries, so the truth is a second instance queried every period.
  template <class Make>
  void remembering(const Make& make) {
    trial.experiment.environment.force = make();
    trial.experiment.environment.truth = make();
  }
};

template <std::size_t Count>
double one_of(Dice& dice, const std::array<double, Count>& values) {
  return values[std::min(static_cast<std::size_t>(dice.within(0, Count)), Count - 1)];
}

Vec3 towards_x(double force) { return {force, 0, 0}; }

void nothing_else(Draft&) {}

void counts(Draft& draft) {
  draft.trial.encoder_step = 1e-6 * draft.dice.decades(1, 2);
  draft.say("count", draft.trial.encoder_step * 1e6, "um");
}

void hands(Draft& draft) {
  auto& hand = *draft.hand.hand;
  hand.mass = draft.dice.decades(-2, 0);
  hand.stiffness = draft.dice.decades(2, 3);
  const double critical = 2 * std::sqrt(hand.stiffness * (hand.mass + draft.hand.mass));
  hand.damping = critical * draft.dice.decades(-2, -0.3);
  draft.say("hand", hand.mass * 1e3, "g");
  draft.say("hand", hand.stiffness, "N/m");
  draft.say("hand", hand.damping, "Ns/m");
}

void tempo(Draft& draft) {
  draft.frequency = 0.25 * std::exp2(std::floor(draft.dice.within(0, 4)));
  draft.amplitude = std::min(0.015, 0.1 / (2 * std::numbers::pi * draft.frequency));
  draft.say("tempo", draft.frequency, "Hz");
}

void wall(Draft& draft) {
  const double at = draft.dice.within(-0.005, 0.01);
  draft.object([k = draft.k, at](double, const Vec3& x) { return towards_x(x.x() > at ? -k * (x.x() - at) : 0); });
  draft.say("wall_at", at * 1e3, "mm");
}

void sphere(Draft& draft) {
  const double radius = draft.dice.within(0.006, 0.02);
  const Vec3 centre(draft.dice.within(0.01, 0.02), draft.dice.within(-0.5, 0.5) * radius, 0.2 * radius);
  draft.object([k = draft.k, centre, radius](double, const Vec3& x) {
    const Vec3 out = x - centre;
    const double distance = out.norm();
    return distance < radius && distance > 0 ? Vec3(k * (radius - distance) / distance * out) : Vec3(Vec3::Zero());
  });
  draft.say("radius", radius * 1e3, "mm");
}

void hardening(Draft& draft) {
  draft.object([k = draft.k](double, const Vec3& x) { return Vec3(-k * x.norm() / 0.01 * x); });
}

/// The object pulls within 2 mm outside its surface once pressed, until the tool detaches.
void adhesion(Draft& draft) {
  const double reach = draft.dice.within(0.5e-3, 2e-3);
  draft.remembering([k = draft.k, reach] {
    return [k, reach, sticks = false](double, const Vec3& x) mutable {
      if (x.x() > 0) sticks = true;
      if (x.x() < -reach) sticks = false;
      return towards_x(sticks ? -k * x.x() : 0);
    };
  });
  draft.say("sticks_for", reach * 1e3, "mm");
}

/// A bristle that moves with the tool up to the Coulomb friction of the surface (Dahl's limit).
void dragging(Draft& draft) {
  const double most = draft.dice.within(0.3, 2);
  draft.remembering([k = draft.k, most] {
    return [k, most, foot = Vec3(Vec3::Zero())](double, const Vec3& x) mutable {
      const Vec3 bend = x - foot;
      const double size = k * bend.norm();
      if (size > most) foot = x - bend * (most / size);
      return Vec3(-k * (x - foot));
    };
  });
  draft.say("friction", most, "N");
}

void moving(Draft& draft) {
  const double reach = draft.dice.within(0.5e-3, 3e-3);
  const double hz = draft.dice.within(0.2, 2);
  draft.object([k = draft.k, reach, hz](double t, const Vec3& x) {
    const double at = reach * portable::sin(2 * std::numbers::pi * hz * t);
    return towards_x(x.x() > at ? -k * (x.x() - at) : 0);
  });
  draft.say("moves", reach * 1e3, "mm");
  draft.say("moves", hz, "Hz");
}

void loop(Draft& draft) {
  const double hz = one_of(draft.dice, std::array{250.0, 500.0, 2000.0, 4000.0});
  draft.trial.experiment.period = from_seconds(1 / hz);
  draft.say("loop", hz, "Hz");
}

void circle(Draft& draft) {
  Mat3 turned;
  const Vec3 a = draft.dice.direction();
  const Vec3 b = (draft.dice.direction().cross(a)).normalized();
  turned << a, b, a.cross(b);
  const Vec3 principal(draft.k, draft.k * draft.dice.within(0.1, 1), draft.k * draft.dice.within(0.1, 1));
  const Mat3 stiffness = turned * principal.asDiagonal() * turned.transpose();
  draft.object([stiffness](double, const Vec3& x) { return Vec3(-stiffness * x); });
  ScriptedMotion::MinimumJerk round;
  constexpr int kCorners = 48;
  for (int i = 0; i <= kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    round.points.push_back(0.012 * Vec3(portable::sin(angle), portable::cos(angle), 0.3 * portable::sin(angle)));
    if (i > 0) round.durations.push_back(std::chrono::nanoseconds(2'000'000'000 / kCorners));
  }
  draft.hand.hand->motion = ScriptedMotion(round);
  draft.frequency = 0;
}

void drawn_out(Draft& draft) {
  draft.object([k = draft.k](double, const Vec3& x) { return towards_x(x.x() > 0 ? -k * x.x() : 0); });
  draft.hand.hand->motion = ScriptedMotion(ScriptedMotion::MinimumJerk{
      .points = {Vec3(-0.005, 0, 0), Vec3(0.012, 0, 0), Vec3(0.012, 0, 0), Vec3(-0.02, 0, 0)},
      .durations = {std::chrono::milliseconds(500), std::chrono::milliseconds(600), std::chrono::milliseconds(60)},
      .back_and_forth = false});
  draft.frequency = 0;
}

constexpr double kInFree = 10;   // s, before the wall
constexpr double kWall = 20000;  // N/m

/// The hand moves back and forth in front of a wall for 10 s, and then up to 12 mm into the wall.
void into_a_wall(Draft& draft) {
  const double amplitude = draft.dice.chance(0.5) ? 0.015 : 0.03;
  const double hz = draft.dice.chance(0.5) ? 0.5 : 1;
  draft.say("waves", amplitude * 1e3, "mm");
  draft.say("waves", hz, "Hz");
  ScriptedMotion::Recorded motion;
  for (int i = 0; i <= 1400; ++i) {
    const double t = i * 0.01;
    const double x = t < kInFree ? -0.05 + amplitude * portable::sin(2 * std::numbers::pi * hz * t)
                                 : std::min(-0.05 + 0.08 * (t - kInFree), 0.012);
    motion.samples.push_back({t, x});
  }
  draft.hand.hand->motion = ScriptedMotion(motion);
  draft.frequency = 0;
  draft.trial.experiment.length = std::chrono::seconds(14);
  draft.k = kWall;
  draft.say("then", kWall, "N/m");
}

void waving(Draft& draft) {
  draft.object([](double, const Vec3& x) { return towards_x(x.x() > 0 ? -kWall * x.x() : 0); });
  into_a_wall(draft);
}

/// As into_a_wall, in a viscous object of 5 N·s/m, into which the hand keeps putting energy.
void stirring(Draft& draft) {
  draft.remembering([] {
    return [before = Vec3(Vec3::Zero()), then = -1.0, speed = Vec3(Vec3::Zero())](double t, const Vec3& x) mutable {
      constexpr double kViscous = 5;     // N·s/m
      constexpr double kWithin = 0.005;  // s, the interval in which the engine of the object measures the velocity
      if (then < 0 || t - then >= kWithin) {
        if (then >= 0) speed = (x - before) / (t - then);
        before = x;
        then = t;
      }
      return Vec3(-kViscous * speed + towards_x(x.x() > 0 ? -kWall * x.x() : 0));
    };
  });
  into_a_wall(draft);
}

void letting_go(Draft& draft) {
  draft.object([k = draft.k](double, const Vec3& x) { return towards_x(x.x() > 0 ? -k * x.x() : 0); });
  const double depth = draft.dice.within(0.005, 0.015);
  draft.hand.hand->motion = ScriptedMotion(
      ScriptedMotion::MinimumJerk{.points = {Vec3(-0.005, 0, 0), Vec3(depth, 0, 0), Vec3(depth, 0, 0)},
                                  .durations = {std::chrono::milliseconds(500), std::chrono::milliseconds(500)},
                                  .back_and_forth = false});
  draft.hand.lets_go_after = std::chrono::seconds(1);
  draft.frequency = 0;
  draft.say("pressed", depth * 1e3, "mm");
}

const char* data_folder() { return std::getenv("TENDON_DATA"); }  // NOLINT(concurrency-mt-unsafe): nobody sets it

/// A human hand recorded on a lever (TENDON_DATA/tue-1dof-teleop: its SOURCE.txt), used as the intended motion.
void recorded(Draft& draft) {
  const std::filesystem::path folder = std::filesystem::path(data_folder()) / "tue-1dof-teleop";
  const bool foam = draft.dice.chance(0.5);
  const std::filesystem::path file = folder / (foam ? "m2_question1d_foam.csv" : "m2_question1d_rigid.csv");
  std::ifstream csv(file);
  if (!csv) throw std::runtime_error(file.string() + ": cannot read the file");
  constexpr double kArm = 0.075;    // m per rad
  constexpr std::size_t kThin = 8;  // 2 kHz to 250 Hz, above the bandwidth of a hand
  const auto all = load_recorded_motion(csv, {.path = file, .position = "master_pos_rad"}).samples;
  ScriptedMotion::Recorded motion;
  for (std::size_t i = 0; i < all.size(); i += kThin) {
    motion.samples.push_back({all[i].t - all[0].t, kArm * (all[i].x - all[0].x)});
  }
  draft.hand.hand->motion = ScriptedMotion(motion);
  draft.frequency = 0;
  draft.trial.drawn += foam ? " hand=foam" : " hand=rigid";
}

struct Kind {
  SituationKind info;
  void (*vary)(Draft&);
};
constexpr std::array kKinds = {
    Kind{{"grid", "springs, as in the grid"}, nothing_else},
    Kind{{"counts", "encoder counts of 10 to 100 um"}, counts},
    Kind{{"hands", "hands of 10 g to 1 kg, 100 to 1000 N/m"}, hands},
    Kind{{"tempo", "0.25 to 2 Hz"}, tempo},
    Kind{{"wall", "a unilateral wall at a random position"}, wall},
    Kind{{"sphere", "a sphere, touched at its side and pressed"}, sphere},
    Kind{{"hardening", "a spring that hardens with its travel"}, hardening},
    Kind{{"adhesion", "an adhesive surface"}, adhesion},
    Kind{{"dragging", "a surface with Coulomb friction"}, dragging},
    Kind{{"moving", "a wall that moves by itself"}, moving},
    Kind{{"loop", "device loops of 250 Hz to 4 kHz"}, loop},
    Kind{{"circle", "a circle in space on an anisotropic spring"}, circle},
    Kind{{"drawn-out", "a hand that leaves a contact within 60 ms"}, drawn_out},
    Kind{{"letting-go", "a hand that lets go of the handle in contact"}, letting_go},
    Kind{{"waving", "10 s of waving, then a wall of 20 kN/m"}, waving},
    Kind{{"stirring", "10 s of stirring 5 N s/m, then a wall of 20 kN/m"}, stirring},
    Kind{{"recorded", "recorded hands on springs (TENDON_DATA)"}, recorded},
};

constexpr auto kInfos = [] {
  std::array<SituationKind, kKinds.size()> infos{};
  for (std::size_t i = 0; i < infos.size(); ++i) infos[i] = kKinds[i].info;
  return infos;
}();

std::string names_of_kinds() {
  std::string names;
  for (const SituationKind& kind : kInfos) names += (names.empty() ? "" : ", ") + std::string(kind.name);
  return names;
}

}  // namespace

std::span<const SituationKind> situation_kinds() noexcept { return kInfos; }

std::optional<Trial> draw_situation(std::string_view kind, std::uint64_t seed) {
  const auto* const found = std::ranges::find(kKinds, kind, [](const Kind& one) { return one.info.name; });
  if (found == kKinds.end()) {
    throw std::invalid_argument("kind \"" + std::string(kind) + "\": expected one of " + names_of_kinds() +
                                did_you_mean(kind, names_of_kinds()));
  }
  if (kind == "recorded" && data_folder() == nullptr) return std::nullopt;
  Dice dice(seed);
  Draft draft{.dice = dice, .trial = {}, .hand = {}};
  Trial& trial = draft.trial;
  Experiment& set = trial.experiment;

  constexpr std::array kFrictions = {Friction{.coulomb = 0.02, .viscous = 0.26},
                                     Friction{.coulomb = 0.04, .viscous = 0.05},
                                     Friction{.coulomb = 0.04, .viscous = 0.005}};
  const Friction friction = kFrictions[std::min<std::size_t>(static_cast<std::size_t>(dice.within(0, 3)), 2)];
  draft.k = one_of(dice, std::array{100.0, 300.0, 500.0, 1000.0, 2000.0, 8000.0});
  const double delay = one_of(dice, std::array{0.0, 5.0, 20.0, 80.0});
  const double jitter = one_of(dice, std::array{0.0, 10.0});
  const double rate = one_of(dice, std::array{1000.0, 200.0, 50.0, 25.0});
  const double loss = one_of(dice, std::array{0.0, 0.2});
  const bool firm = dice.chance(0.5);
  draft.say("K", draft.k, "N/m");
  draft.say("delay", delay, "ms");
  draft.say("jitter", jitter, "ms");
  draft.say("rate", rate, "Hz");
  draft.say("loss", loss, "");
  draft.say("b", friction.viscous, "Ns/m");
  trial.drawn += firm ? " firm" : " loose";

  draft.hand = paper_hand(friction);
  if (firm) {
    draft.hand.hand->stiffness = 800;
    draft.hand.hand->damping = 3;
    draft.hand.hand->mass = 0.1;
  }
  trial.encoder_step = kPaperEncoder;
  draft.object([k = draft.k](double, const Vec3& x) { return Vec3(-k * x); });
  set.environment.period = from_seconds(1 / rate);
  set.environment.delay = from_seconds(delay * 1e-3);
  set.environment.jitter = from_seconds(jitter * 1e-3);
  set.environment.loss = loss;
  set.length = std::chrono::seconds(2);
  set.max_force = kPaperMaxForce;
  set.seed = seed;

  found->vary(draft);

  if (draft.frequency > 0) {
    draft.hand.hand->motion =
        ScriptedMotion(ScriptedMotion::Sine{.amplitude = draft.amplitude, .frequency = draft.frequency});
  }
  draft.hand.encoder_step = trial.encoder_step;
  set.hand = draft.hand;
  set.limiter.friction = friction;
  set.limiter.environment_stiffness = draft.k;
  set.limiter.environment_delay = set.environment.delay;
  trial.stiffness = draft.k;
  return std::move(trial);
}

std::vector<Contender> contenders() {
  std::vector<Contender> all;
  for (const LawInfo& law : laws()) all.push_back({.name = law.name, .law = law.law, .promises = law.passive});
  for (const PresetInfo& preset : presets()) {
    all.push_back({.name = preset.name, .preset = preset.preset, .promises = true});
  }
  return all;
}

Outcome outcome_of(const Contender& contender, const Trial& trial) {
  Experiment set = trial.experiment;
  set.limiter.law = contender.law;
  if (contender.preset) {
    const PresetParts chosen = preset_parts(
        *contender.preset,
        {.friction = set.limiter.friction, .longest_hold = set.period, .encoder_step = trial.encoder_step});
    set.limiter.parts = chosen.parts;
    set.learned_model = chosen.learned_model;
  } else {
    set.limiter.parts = parts_without_preset(set.limiter.friction, trial.encoder_step);
  }
  return outcome(run(set), set.period);
}

}  // namespace tendon::lab
