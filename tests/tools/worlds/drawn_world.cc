// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/drawn_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/support/any_contact.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/worlds/drawn_handle.h"

namespace tendon::simulation {

namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr std::array<const char*, 6> kEngineNames = {"spring",      "wall with local model", "a million newton",
                                                     "force steps", "negative spring",       "pushes along"};
using std::chrono::milliseconds;

std::string ms(Duration duration) { return number(seconds(duration) * 1e3) + " ms"; }

Duration whole_ms(Dice& dice, double low, double high) {
  return milliseconds(static_cast<int>(dice.within(low, high)));
}

/// Quantized to factors of 2^¼ and whole milliseconds, because delay models are compiled once per parameter set.
Duration typical(Dice& dice, double low_ms, double high_ms) {
  const double octaves = std::log2(high_ms / low_ms);
  return std::max<Duration>(
      milliseconds(1), milliseconds(static_cast<int>(low_ms * std::exp2(std::floor(dice.within(0, octaves) * 4) / 4))));
}

injector::Delay draw_delay(Dice& dice, double longest_ms) {
  const Duration mean = typical(dice, 1, longest_ms);
  switch (static_cast<int>(dice.within(0, 7))) {
    case 0:
      return injector::ConstantDelay{mean};
    case 1:
      return injector::UniformDelay{mean / 2, mean + mean / 2};
    case 2:
      return injector::NormalDelay{mean, mean / 4};
    case 3:
      return injector::ExponentialDelay{mean / 2, mean};
    case 4:
      return injector::LognormalDelay{mean, mean / 2};
    case 5:
      return injector::ParetoDelay{mean / 2, 2.5};
    default:
      return injector::GammaDelay{mean, mean / 2};
  }
}

injector::Loss draw_loss(Dice& dice) {
  const double share = dice.within(0, 0.4);
  switch (static_cast<int>(dice.within(0, 6))) {
    case 0:
      return injector::RandomLoss{0};
    case 1:
      return injector::BurstLoss{share, share / (1 - share) + dice.within(1, 20)};
    case 2:
      return injector::GilbertLoss{.to_bad = dice.within(0.001, 0.1),
                                   .to_good = dice.within(0.01, 0.5),
                                   .lost_in_bad = dice.within(0.5, 1),
                                   .lost_in_good = dice.within(0, 0.02)};
    case 3:
      return injector::FourStateLoss{.p13 = dice.within(0.001, 0.1),
                                     .p31 = dice.within(0.1, 0.5),
                                     .p32 = dice.within(0, 0.4),
                                     .p23 = dice.within(0.1, 0.9),
                                     .p14 = dice.within(0, 0.05)};
    case 4:
      return injector::PatternLoss{dice.chance(0.5) ? "0001" : "0110100"};
    default:
      return injector::RandomLoss{share};
  }
}

injector::Window draw_window(Dice& dice, double lasts_ms) {
  injector::Window window;
  window.at = whole_ms(dice, 0, 2000);
  window.lasts = whole_ms(dice, 5, lasts_ms);
  if (dice.chance(0.6)) window.every = window.lasts + whole_ms(dice, 50, 1500);
  return window;
}

}  // namespace

injector::Profile draw_bad_weather(Dice& dice) {
  injector::Profile p;
  if (dice.chance(0.15)) {
    // Later names would change the worlds of the seeds that are kept.
    const auto names = injector::named_profiles().first(8);
    const auto& named = names[dice.bits() % names.size()];
    p = injector::parse_profile(dice.chance(0.5) ? named.up : named.down);
  } else {
    if (dice.chance(0.5)) p.base = whole_ms(dice, 1, 50);
    p.delay = draw_delay(dice, dice.chance(0.2) ? 300 : 60);
    if (dice.chance(0.5)) {
      (dice.chance(0.5) ? void(p.rho = std::floor(dice.within(0.1, 0.99) * 20) / 20)
                        : void(p.memory = milliseconds(20)));
    }
    p.loss = draw_loss(dice);
  }
  if (dice.chance(0.3)) p.duplicate = dice.within(0, 0.3);
  if (dice.chance(0.15))
    p.replay = {dice.within(0, 0.05), 1 + static_cast<std::uint32_t>(dice.bits() % injector::kMaxReplayDepth)};
  if (dice.chance(0.1)) p.truncate = dice.within(0, 0.05);
  if (dice.chance(0.15)) p.order = injector::Order::kFree;
  if (dice.chance(0.15)) p.jump = {dice.within(0, 0.1), 1 + static_cast<std::uint32_t>(dice.bits() % 10)};
  if (dice.chance(0.1)) {
    p.regimes = {{"clear", whole_ms(dice, 100, 1500), injector::ConstantDelay{}, std::nullopt},
                 {"busy", whole_ms(dice, 20, 400), draw_delay(dice, 100), draw_loss(dice)}};
  }
  if (dice.chance(0.1)) p.steps.push_back({whole_ms(dice, 100, 2000), whole_ms(dice, 1, 100)});
  if (dice.chance(0.1)) p.ramps.push_back({milliseconds(200), whole_ms(dice, 300, 2500), whole_ms(dice, 1, 200)});
  if (dice.chance(0.15)) p.spikes.push_back({draw_window(dice, 200), whole_ms(dice, 10, 300)});
  if (dice.chance(0.15)) p.stalls.push_back({draw_window(dice, 400)});
  if (dice.chance(0.1)) p.handovers.push_back({draw_window(dice, 200), whole_ms(dice, 1, 30)});
  if (dice.chance(0.15)) p.outages.push_back({draw_window(dice, 2500)});
  if (dice.chance(0.1)) {
    p.bottleneck.bits_per_second = static_cast<std::uint64_t>(dice.decades(4.8, 7));
    p.bottleneck.queue = 5 + dice.bits() % 100;
  }
  return p;
}

namespace {

Network::Weather draw_weather(Dice& dice, DrawnWorld& world) {
  Network::Weather weather{draw_bad_weather(dice), draw_bad_weather(dice)};
  if (dice.chance(0.05)) weather.up.rebind = whole_ms(dice, 400, 3000);
  if (dice.chance(0.08)) {
    world.damages = true;
    (dice.chance(0.5) ? weather.up : weather.down).flip = dice.decades(-4, -1);
  }
  return weather;
}

void draw_law(Dice& dice, HapticController::Config& control, bool encoder, double encoder_step) {
  constexpr std::array kPassive = {Law::kAol,
                                   Law::kAol,
                                   Law::kAolPlus,
                                   Law::kAolPlus,
                                   Law::kAolPerAxis,
                                   Law::kAolBox,
                                   Law::kEnergyBounding,
                                   Law::kForceBounding,
                                   Law::kMemorylessForceBounding,
                                   Law::kNonlinearCoupling};
  LimiterConfig& limiter = control.limiter;
  limiter.law = kPassive[dice.bits() % kPassive.size()];
  if (limiter.law != Law::kAolPlus) return;
  if (dice.chance(0.5)) limiter.parts.energy_cap.emplace();
  if (dice.chance(0.5)) {
    auto& robust = limiter.parts.robust_ledger.emplace();
    robust.encoder_step = {encoder ? encoder_step : 1e-6};
  }
  if (dice.chance(0.5)) limiter.parts.knee.emplace();
  if (dice.chance(0.2)) limiter.parts.latency_reserve.emplace();
  if (dice.chance(0.2)) limiter.parts.adaptive_friction.emplace();
}

ScriptedMotion draw_motion(Dice& dice) {
  const Vec3 along = dice.direction();
  switch (static_cast<int>(dice.within(0, 4))) {
    case 0:
      return ScriptedMotion(ScriptedMotion::RampHold{.from = -0.02 * along,
                                                     .to = dice.within(0.002, 0.03) * along,
                                                     .ramp = dice.milliseconds(50, 1500),
                                                     .hold = dice.milliseconds(0, 500)});
    case 1: {
      ScriptedMotion::MinimumJerk reach;
      for (int i = 0; i < 4; ++i) {
        reach.points.push_back(dice.direction() * dice.within(0, 0.03));
        if (i > 0) reach.durations.push_back(dice.milliseconds(200, 900));
      }
      return ScriptedMotion(std::move(reach));
    }
    default:
      return ScriptedMotion(ScriptedMotion::Sine{
          .amplitude = dice.within(1e-3, 0.04), .frequency = dice.decades(-0.5, 1), .direction = along});
  }
}

void draw_device(Dice& dice, DrawnWorld& world, bool sabotaged) {
  auto& control = world.config.loop.control;
  const Friction& friction = control.limiter.friction;
  if (dice.chance(0.4) || sabotaged) {
    AdversaryDevice::Config device;
    device.friction = friction;
    device.hostility = dice.uniform();
    device.largest_move = dice.decades(-4, -2);
    if (dice.chance(0.5)) device.clamp = control.max_force * dice.uniform();
    if (sabotaged) device.clamp = kEndless;
    world.device = device;
    return;
  }
  SimulatedDevice::Config device;
  device.mass = dice.decades(-1.5, 0);
  if (friction.coulomb > 0) device.coulomb_friction = friction.coulomb * (1 + dice.uniform());
  device.viscous_friction = friction.viscous * (1 + dice.uniform());
  if (dice.chance(0.5)) device.max_force = control.max_force * dice.within(0.1, 1);
  if (dice.chance(0.2)) device.encoder_step = dice.decades(-5.5, -4);
  if (dice.chance(0.15)) device.amplifier_bandwidth = dice.within(50, 1000);
  if (dice.chance(0.15)) {
    device.watchdog = whole_ms(dice, 3, 20);
    control.watchdog = *device.watchdog;
  }
  // The server is under test: the energy balance is exact for any substep.
  device.max_substep = std::chrono::microseconds(250);
  device.hand = OperatorHand::Config{.stiffness = dice.decades(1, 3),
                                     .damping = dice.decades(-1, 1),
                                     .mass = dice.within(0, 0.1),
                                     .motion = draw_motion(dice)};
  world.device = std::move(device);
}

/// Some devices have joint friction, some a structural mode; both preserve the energy balance at the motors, where port
/// and limiter are. (Transport delay does not: the force felt is then not the force returned.) Uses its own random
/// stream so that the rest of the world is unchanged.
void draw_mechanism(Dice dice, DrawnWorld& world) {
  auto* device = std::get_if<SimulatedDevice::Config>(&world.device);
  if (device == nullptr) return;
  if (device->coulomb_friction && dice.chance(0.3)) {
    auto& joints = device->joint_friction.emplace();
    if (dice.chance(0.5)) joints.mechanism = Mechanism::Arm{dice.within(0.08, 0.3), dice.within(0.08, 0.3)};
    joints.coulomb = JointFriction::torques(joints.mechanism, *device->coulomb_friction);
    device->coulomb_friction.reset();
  }
  if (dice.chance(0.3)) {
    device->structural_mode = {.handle_mass = device->mass * dice.within(0.1, 0.9),
                               .stiffness = dice.decades(2.5, 5),
                               .damping = dice.decades(-2, 0.5)};
  }
}

DrawnClient draw_client(Dice& dice, DrawnClient::Kind kind, std::size_t number) {
  DrawnClient client;
  client.kind = kind;
  client.seed = dice.bits();
  client.config.name = std::string(1, static_cast<char>('Z' - number));
  client.config.seed = dice.bits();
  client.config.state_hz = dice.chance(0.3) ? 0 : static_cast<std::uint32_t>(dice.decades(1.3, 3));
  client.config.rate_hz = dice.chance(0.1) ? 0 : dice.decades(0.5, 3);
  client.config.valid_for = dice.chance(0.3) ? Duration::zero() : dice.milliseconds(5, 400);
  client.config.retry_min = dice.milliseconds(20, 200);
  client.config.retry_max = dice.milliseconds(200, 1500);
  client.config.patience = dice.milliseconds(500, 2000);
  client.engine = static_cast<Engine>(dice.within(0, kEngineNames.size()));
  client.stiffness = dice.decades(1, 5);
  client.bad_days = dice.chance(0.3) ? 0.1 : 0;
  client.joins = dice.chance(0.6) ? Duration::zero() : dice.milliseconds(0, 2000);
  if (dice.chance(0.5)) {
    client.clock.offset = from_seconds(dice.within(-1000, 1000));
    client.clock.drift_ppb = static_cast<std::int64_t>(dice.within(-200'000, 200'000));
    if (dice.chance(0.1)) client.clock.steps.push_back({whole_ms(dice, 500, 3000), dice.milliseconds(1, 50)});
  }
  if (kind == DrawnClient::Kind::kRogue) {
    client.rogue.role = dice.chance(0.7) ? Role::kController : Role::kObserver;
    client.rogue.seed = dice.bits();
    client.rogue.quits = LocalTime(dice.milliseconds(500, 2000));
  }
  return client;
}

void draw_clients(Dice& dice, DrawnWorld& world) {
  using Kind = DrawnClient::Kind;
  std::vector<Kind> kinds = {Kind::kController};
  if (dice.chance(0.15)) kinds.push_back(Kind::kController);
  while (kinds.size() < 4 && dice.chance(0.2)) kinds.push_back(Kind::kObserver);
  if (dice.chance(0.1)) kinds.push_back(Kind::kRogue);
  for (const Kind kind : kinds) {
    DrawnClient client = draw_client(dice, kind, world.clients.size());
    if (kind != Kind::kRogue && dice.chance(0.12)) {
      client.killed = client.joins + dice.milliseconds(100, 2000);
      if (kind == Kind::kController && dice.chance(0.7)) client.restarted = *client.killed + dice.milliseconds(0, 600);
    }
    world.clients.push_back(std::move(client));
  }
  std::ranges::stable_sort(world.clients, {}, &DrawnClient::joins);
}

/// Half of the worlds use suite 1. Most of those renew keys so often that outages outlast some, and their clients'
/// addresses may change at any time. It uses its own random stream, so that the rest of the world is unchanged.
void draw_suite(Dice dice, DrawnWorld& world) {
  if (dice.chance(0.5)) return;
  Ratchet secrets(dice.bits());
  for (DrawnClient& client : world.clients) {
    const bool rogue = client.kind == DrawnClient::Kind::kRogue;
    const bool observes = client.kind == DrawnClient::Kind::kObserver || client.rogue.role == Role::kObserver;
    const ClientKey key{
        .name = client.config.name, .role = observes ? Role::kObserver : Role::kController, .key = secrets.next()};
    world.config.keys.push_back(key);
    (rogue ? client.rogue.key : client.config.key) = key.key;
  }
  if (dice.chance(0.7)) {
    world.config.rekey = {.datagrams = static_cast<std::uint64_t>(dice.decades(2, 4)),
                          .age = dice.milliseconds(500, 5000),
                          .overlap = dice.milliseconds(100, 2000)};
  }
  if (dice.chance(0.3)) {
    const Duration rebind = whole_ms(dice, 300, 3000);
    world.config.weather.up.rebind = rebind;
    for (DrawnWorld::Change& change : world.changes) change.weather.up.rebind = rebind;
  }
}

/// From kFirstSeedOfSuite2 on, half of the sealed worlds have a server with AES. A third of those allow only AES; in
/// the others some clients do not know suite 2. Its own random stream leaves the rest unchanged.
void draw_aes(Dice dice, DrawnWorld& world) {
  for (DrawnClient& client : world.clients) client.config.suites = client.rogue.suites = world.config.suites;
  if (world.seed < kFirstSeedOfSuite2 || !world.sealed() || dice.chance(0.5)) return;
  const bool only = dice.chance(0.33);
  world.config.suites = only ? Suites{Suite::kAesGcm} : all_suites();
  for (DrawnClient& client : world.clients) {
    if (only || dice.chance(0.7)) client.config.suites = client.rogue.suites = world.config.suites;
  }
}

}  // namespace

bool DrawnWorld::rogue() const {
  return std::ranges::any_of(clients, [](const auto& c) { return c.kind == DrawnClient::Kind::kRogue; });
}

bool DrawnWorld::exact() const {
  const auto* simulated = std::get_if<SimulatedDevice::Config>(&device);
  return simulated != nullptr && !simulated->encoder_step && !simulated->amplifier_bandwidth && !simulated->watchdog &&
         port.unseen == 0 && (!simulated->rotation || !simulated->rotation->encoder_step);
}

DrawnWorld draw_world(std::uint64_t seed, const Sabotage& sabotage) {
  const bool sabotaged = sabotage != Sabotage{};
  Dice dice(seed);
  DrawnWorld world;
  world.seed = seed;
  World::Config& config = world.config;
  config.seed = seed;
  config.mail = {.steps = 16, .flight = 1, .datagrams = 1};
  HapticController::Config& control = config.loop.control;
  control.limiter.friction = {dice.chance(0.2) ? 0.0 : dice.decades(-3, -0.3), dice.decades(-2.5, 0.3)};

  // Periods of 0.5 … 2 ms, mostly 1. An interval is at most two periods, less the lateness of the previous step.
  config.loop.period = std::chrono::microseconds(dice.chance(0.7) ? 1000 : static_cast<int>(dice.within(500, 2000)));
  const bool punctual = dice.chance(0.3) || sabotaged;
  config.latest_wake = punctual ? Duration::zero() : config.loop.period;
  control.limiter.longest_hold = punctual ? config.loop.period : 2 * config.loop.period;
  control.max_force = dice.decades(0, 2);
  control.max_slew = dice.chance(0.3) ? kEndless : dice.decades(2, 5);
  if (dice.chance(0.1) && !sabotaged) {
    config.pause_probability = 2e-3;
    config.pause = dice.milliseconds(5, 60);
  }
  draw_device(dice, world, sabotaged);
  const auto* simulated = std::get_if<SimulatedDevice::Config>(&world.device);
  const bool counts = simulated != nullptr && simulated->encoder_step.has_value();
  draw_law(dice, control, counts, counts ? *simulated->encoder_step : 0);

  world.port.friction = control.limiter.friction;
  world.port.watchdog = control.watchdog;
  world.port.seed = dice.bits();
  if (dice.chance(0.08) && !sabotaged) {
    world.port.unseen = dice.decades(-3, -1.5);
    world.port.most_gone = dice.chance(0.5) ? 3 : 40;
  }

  draw_clients(dice, world);
  if (dice.chance(0.1)) world.garbage_hz = dice.within(10, 300);

  config.weather = draw_weather(dice, world);
  world.clears = whole_ms(dice, 1500, 4500);
  if (dice.chance(0.4)) world.changes.push_back({whole_ms(dice, 300, 1400), draw_weather(dice, world)});
  Network::Weather fair;
  // A round trip shorter than the clock drift during an echo's hold (10 µs) would be negative and be discarded.
  world.one_way_up = whole_ms(dice, 1, 20);
  world.one_way_down = whole_ms(dice, 1, 20);
  fair.up.delay = injector::ConstantDelay{world.one_way_up};
  fair.down.delay = injector::ConstantDelay{world.one_way_down};
  world.changes.push_back({world.clears, fair});
  draw_suite(Dice(~seed), world);
  draw_aes(Dice(~seed ^ 0x510e527fade682d1), world);
  draw_mechanism(Dice(seed ^ 0x9e3779b97f4a7c15), world);
  draw_handle(Dice(seed ^ 0x2545f4914f6cdd1d), world, sabotage);
  return world;
}

std::string describe(const DrawnWorld& world) {
  const World::Config& config = world.config;
  const HapticController::Config& control = config.loop.control;
  std::string text = "world " + std::to_string(world.seed) + ": ";
  if (const auto* device = std::get_if<SimulatedDevice::Config>(&world.device)) {
    text += "a hand with " + number(device->mass) + " kg";
    if (device->encoder_step) text += ", encoder steps of " + number(*device->encoder_step * 1e6) + " µm";
    if (device->amplifier_bandwidth) text += ", an amplifier of " + number(*device->amplifier_bandwidth) + " Hz";
    if (device->watchdog) text += ", a watchdog of " + ms(*device->watchdog);
    if (device->joint_friction) text += ", friction in its joints";
    if (device->structural_mode) {
      text += ", a structural mode of " + number(device->structural_mode->stiffness) + " N/m";
    }
  } else {
    text += "an adversary";
  }
  text += describe_handle(world);
  const AolPlus<1, 3>::Parts& parts = control.limiter.parts;
  text += "; " + std::string(info(control.limiter.law).name);
  if (parts.energy_cap) text += " energy_cap";
  if (parts.robust_ledger) text += " robust_ledger";
  if (parts.knee) text += " knee";
  if (parts.latency_reserve) text += " latency_reserve";
  if (parts.adaptive_friction) text += " adaptive_friction";
  text += ", b " + number(control.limiter.friction.viscous) + " N·s/m, f_c " +
          number(control.limiter.friction.coulomb) + " N, at most " + number(control.max_force) + " N; every " +
          ms(config.loop.period);
  if (config.latest_wake > Duration::zero()) text += ", wakes up to " + ms(config.latest_wake) + " late";
  if (world.pauses()) text += ", pauses of " + ms(config.pause);
  if (world.port.unseen > 0) text += ", readings can fail";
  const bool aes = contains(config.suites, Suite::kAesGcm);
  text += world.sealed() ? (aes ? "; by " + names_of(config.suites) : "; suite 1") + ", a key for " +
                               std::to_string(config.rekey.datagrams) + " datagrams or " + ms(config.rekey.age)
                         : "; suite 0";
  for (const DrawnClient& client : world.clients) {
    switch (client.kind) {
      case DrawnClient::Kind::kController:
        text += "\n  controller " + client.config.name + ": " + kEngineNames[static_cast<std::size_t>(client.engine)] +
                ", " + number(client.stiffness) + " N/m, " + number(client.config.rate_hz) + " Hz of " +
                std::to_string(client.config.state_hz);
        break;
      case DrawnClient::Kind::kObserver:
        text += "\n  observer " + client.config.name;
        break;
      case DrawnClient::Kind::kRogue:
        text += std::string("\n  rogue ") + (client.rogue.role == Role::kController ? "controller" : "observer") +
                " until " + ms(client.rogue.quits.time_since_epoch());
        break;
    }
    if (aes && !contains(client.config.suites, Suite::kAesGcm)) text += ", does not support suite 2";
    text += ", from " + ms(client.joins);
    if (client.killed) text += ", killed at " + ms(*client.killed);
    if (client.restarted) text += ", restarted at " + ms(*client.restarted);
  }
  if (world.garbage_hz > 0) text += "\n  garbage: " + number(world.garbage_hz) + " Hz";
  const auto tell = [&](Duration from, const Network::Weather& weather) {
    text += "\n  network from " + ms(from) + "\n    up   " + to_string(weather.up) + "\n    down " +
            to_string(weather.down);
  };
  tell(Duration::zero(), config.weather);
  for (const auto& change : world.changes) tell(change.at, change.weather);
  return text;
}

namespace {

void say_more(Dice& dice, const DeviceState& hand, Touch& touch) {
  if (dice.chance(0.3)) touch.valid_radius = dice.decades(-5, 0);
  if (dice.chance(0.5)) touch.contact = any_contact(dice, hand.position);
  touch.topology_changed = dice.chance(0.05);
  if (dice.chance(0.5)) touch.error = dice.decades(-3, 1);
}

}  // namespace

Physics make_physics(const DrawnClient& client) {
  const double k = client.stiffness;
  auto of_a_point = [client, k, dice = Dice(client.seed)](const DeviceState& hand) mutable -> Touch {
    if (client.bad_days > 0 && dice.chance(client.bad_days)) {
      return Vec3(dice.chance(0.5) ? Vec3(Vec3::Constant(std::nan(""))) : Vec3(0, kEndless, 0));
    }
    switch (client.engine) {
      case Engine::kSpring:
        return Vec3(-k * hand.position);
      case Engine::kWall: {
        const double depth = std::max(0.0, hand.position.x());
        Touch touch = Vec3(-k * depth, 0, 0);
        if (depth > 0) touch.stiffness = Vec3(k, 0, 0).asDiagonal();
        say_more(dice, hand, touch);
        return touch;
      }
      case Engine::kMillion:
        return Vec3(dice.direction() * 1e6);
      case Engine::kSteps:
        return Vec3(dice.direction() * (dice.chance(0.5) ? 0.0 : dice.decades(-2, 2)));
      case Engine::kNegative: {
        Touch touch = Vec3(k * hand.position + 10 * hand.velocity);
        touch.stiffness = Mat3(-k * Mat3::Identity());
        say_more(dice, hand, touch);
        return touch;
      }
      case Engine::kPushesAlong:
        break;
    }
    return Vec3(hand.force_applied.norm() > 1e-3 ? Vec3(hand.force_applied * 100) : dice.direction());
  };
  return [client, of_a_point = std::move(of_a_point),
          dice = Dice(~client.seed)](const DeviceState& hand) mutable -> Touch {
    Touch answer = of_a_point(hand);
    answer_handle(client, dice, hand, answer);
    return answer;
  };
}

}  // namespace tendon::simulation
