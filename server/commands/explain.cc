// SPDX-License-Identifier: Apache-2.0
#include "server/commands/explain.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <variant>

#include "core/control/preset.h"
#include "core/field/brick_field.h"
#include "core/field/field.h"
#include "devices/simulated/simulated_device.h"
#include "server/clients/field_slots.h"

namespace tendon {
namespace {

constexpr int kSteps = 200;
constexpr int kSamples = 2000;  ///< used instead of the device

class TraceDevice final : public Device {
 public:
  TraceDevice(const SimulatedDevice::Config& config, std::vector<PositionSample>& samples)
      : device_(config), samples_(samples) {}

  const DeviceInfo& info() const noexcept override { return device_.info(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    auto sample = device_.read(now);
    if (sample) samples_.push_back(*sample);
    return sample;
  }
  Vec3 apply(const Vec3& force) noexcept override { return device_.apply(force); }
  Effort apply_all(const Effort& effort) noexcept override { return device_.apply_all(effort); }

 private:
  SimulatedDevice device_;
  std::vector<PositionSample>& samples_;
};

/// Plays recorded samples alternately forwards and backwards. Its cost is negligible.
class Playback final : public Device {
 public:
  Playback(DeviceInfo info, std::vector<PositionSample> samples)
      : info_(std::move(info)), samples_(std::move(samples)) {}

  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    const std::size_t turn = next_++ % (2 * samples_.size());
    PositionSample sample = samples_[turn < samples_.size() ? turn : 2 * samples_.size() - 1 - turn];
    sample.at = now;
    return sample;
  }
  Vec3 apply(const Vec3& force) noexcept override { return force; }
  Effort apply_all(const Effort& effort) noexcept override { return effort; }

 private:
  DeviceInfo info_;
  std::vector<PositionSample> samples_;
  std::size_t next_ = 0;
};

/// A sphere of 30 mm in bricks of 2 mm. The origin, from which most hands start, is 3 mm below its surface.
const field::Field& measured_field() {
  static const field::BrickField kBricks = [] {
    field::BrickField bricks;
    const Vec3 centre(0, 0, -0.027);
    const Vec3 half = Vec3::Constant(0.04);
    sample([&](const Vec3& x) { return (x - centre).norm() - 0.03; }, centre - half, centre + half, 2e-3, bricks);
    return bricks;
  }();
  static const field::Field kField{.bricks = &kBricks};
  return kField;
}

class Trial {
 public:
  Trial(const Scene& scene, std::unique_ptr<Device> device)
      : device_(std::move(device)),
        safe_(made_safe(scene, *device_)),
        mail_(std::make_unique<Mailboxes>(
            Mailboxes::Capacities{.steps = 2, .flight = 2, .datagrams = 1, .fields = scene.has_fields()})),
        loop_(scene.loop, safe_ ? static_cast<Device&>(*safe_) : *device_, *mail_),
        period_(scene.loop.period) {
    if (mail_->fields) mail_->fields->front().use.put({.use = {&measured_field(), 1, 1}, .number = 1});
  }
  explicit Trial(const Scene& scene) : Trial(scene, std::make_unique<SimulatedDevice>(scene.simulated())) {}

  double steps(const std::function<Duration()>& processor_time) {
    const Duration before = processor_time();
    for (int i = 0; i < kSteps; ++i) {
      loop_.step(now_);
      mail_->steps.pop();
      if (++step_ % 10 == 0) answer();
      now_ += period_;
    }
    return per_step(processor_time() - before);
  }

 private:
  static constexpr double kStiffness = -500;  // N/m

  static double per_step(Duration total) { return static_cast<double>(total.count()) / kSteps; }

  /// Arms the device as soon as possible because some parts are only active while it is armed.
  static std::unique_ptr<SafeDevice> made_safe(const Scene& scene, Device& device) {
    if (!scene.safety) return nullptr;
    SafeDevice::Config config = *scene.safety;
    config.arming = {.by = SafeDevice::Arming::By::kStart, .rest_speed = 1e3, .rest_force = 1e3};
    return std::make_unique<SafeDevice>(config, device);
  }

  void answer() {
    const DeviceState* state = mail_->state.take();
    if (state == nullptr) return;
    RemoteForce force;
    force.sequence = step_;
    force.received = now_;
    force.answers = now_;
    force.force = kStiffness * state->position;
    force.model = LocalModel{state->position, Mat3(-kStiffness * Mat3::Identity())};
    force.valid_for = 20 * period_;
    mail_->forces[0].put(force);
  }

  std::unique_ptr<Device> device_;
  std::unique_ptr<SafeDevice> safe_;
  std::unique_ptr<Mailboxes> mail_;
  HapticLoop loop_;
  Duration period_;
  LocalTime now_{std::chrono::seconds(1)};
  std::uint64_t step_ = 0;
};

std::unique_ptr<Device> playback_of(const Scene& scene) {
  std::vector<PositionSample> samples;
  samples.reserve(kSamples);
  Trial trial(scene, std::make_unique<TraceDevice>(scene.simulated(), samples));
  for (int i = 0; i < kSamples / kSteps; ++i) trial.steps([] { return Duration::zero(); });
  if (samples.empty()) samples.emplace_back();
  return std::make_unique<Playback>(SimulatedDevice(scene.simulated()).info(), std::move(samples));
}

/// The uncertainty is the difference between the minima of the odd and the even measurements.
class Minimum {
 public:
  void add(double value) {
    std::swap(here_, there_);
    here_ = std::min(here_, value);
  }
  double value() const { return std::min(here_, there_); }
  double doubt() const { return std::abs(here_ - there_); }

 private:
  double here_ = std::numeric_limits<double>::infinity();
  double there_ = std::numeric_limits<double>::infinity();
};

}  // namespace

Explanation explain(const Scene& listed, const std::function<Duration()>& processor_time, int rounds) {
  Explanation out;
  Scene scene = listed;
  scene.device = listed.simulated();
  // The original scene, a copy, the scene with a playback device, and the scene without each of its parts.
  std::vector<std::unique_ptr<Trial>> trials;
  trials.push_back(std::make_unique<Trial>(scene));
  trials.push_back(std::make_unique<Trial>(scene));
  trials.push_back(std::make_unique<Trial>(scene, playback_of(scene)));
  constexpr std::size_t kWithoutDevice = 2;
  std::vector<std::size_t> part_of(trials.size());
  for (const ScenePart& each : scene_parts()) {
    out.parts.push_back({each.key, each.what, {}});
    Scene less = scene;
    if (!take_out(less, each.key)) continue;
    trials.push_back(std::make_unique<Trial>(less));
    part_of.push_back(out.parts.size() - 1);
  }
  std::vector<Minimum> least(trials.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < trials.size(); ++i) least[i].add(trials[i]->steps(processor_time));
  }
  out.step_ns = least[0].value();
  out.device_ns = std::clamp(out.step_ns - least[kWithoutDevice].value(), 0.0, out.step_ns);
  out.resolution_ns = std::abs(least[0].value() - least[1].value());
  for (const Minimum& one : least) out.resolution_ns = std::max(out.resolution_ns, one.doubt());
  for (std::size_t i = kWithoutDevice + 1; i < trials.size(); ++i) {
    out.parts[part_of[i]].cost_ns = out.step_ns - least[i].value();
  }
  return out;
}

namespace {

/// N/m. The highest stiffness of this limiter, 2 b/T (core/PROOFS.md, "Operational stiffness").
double operational_stiffness(const LimiterConfig& limiter) {
  return 2 * limiter.friction.viscous / seconds(limiter.longest_hold);
}

std::string megabytes(double bytes) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << bytes / 1e6 << " MB";
  return text.str();
}

void put_fields(const Scene& scene, std::ostream& text) {
  const field::Renderer::Config& renderer = *scene.loop.control.hold.field;
  const double most = operational_stiffness(scene.loop.control.limiter);
  std::string channels;
  std::size_t count = 0;
  for (const Scene::Channel& channel : scene.channels) {
    if (!scene.may_use_fields(channel)) continue;
    channels += (channels.empty() ? "" : ", ") + channel.name;
    ++count;
  }
  const double slots = static_cast<double>(count * FieldSlots::memory());
  text << "Fields: in " << channels << "; " << megabytes(slots) << " for " << FieldSlots::kCount
       << " fields of each channel, and " << megabytes(scene.fields.cache_bytes)
       << " for uploaded bricks, for each network thread\n  ";
  if (renderer.max_stiffness > most) {
    text << renderer.max_stiffness << " > 2b/T = " << std::llround(most) << " N/m: the limiter will clip";
  } else {
    text << renderer.max_stiffness << " ≤ 2b/T = " << std::llround(most)
         << " N/m: a field cannot give out energy, even without the limiter, if the sum of its stiffnesses does not "
            "exceed this (core/field/README.md, Theorem 1)";
  }
  text << "\n  a moving object gives the hand ";
  if (renderer.push.push_j == 0) {
    text << "no energy";
  } else {
    text << "at most " << renderer.push.push_j << " J + " << renderer.push.push_w << " W · t";
  }
  text << '\n';
}

/// This assumes that the configuration of both ends is the same.
void put_coupling(const Coupling::Config& coupling, const LimiterConfig& limiter, std::ostream& text) {
  const bool leads = coupling.role == PortRole::kLeader;
  const bool waves = coupling.method == CouplingMethod::kWaves;
  const bool springs = info(coupling.method).has_springs;
  const auto& spring = coupling.spring;
  text << std::right << "Teleoperation: the " << (leads ? "leader" : "follower") << " of a coupling by "
       << to_string(coupling.method) << (coupling.tank ? " with shared energy accounts" : "") << ".\n";
  if (coupling.method == CouplingMethod::kPassivity) {
    text << "  the stiffness of the follower's spring is " << spring.stiffness
         << " N/m at every round trip; in free motion the leader "
         << "feels a damper of " << spring.own_damping << " to " << 2 * spring.own_damping
         << " N·s/m, and the force that moves the follower\n";
  }
  if (coupling.rate) {
    const double scale = coupling.map.position_scale * 1e3;
    text << "  the follower moves at " << coupling.rate->gain * scale * 1e-3
         << " mm/s for each mm of the leader beyond " << coupling.rate->dead_zone * 1e3 << " mm, at most "
         << coupling.rate->max_speed * scale << " mm/s\n";
  }
  if (!waves && !springs) return;
  text << "  the limiters reduce the stiffness to at most " << std::llround(operational_stiffness(limiter) / 2)
       << " N/m, if the other end has the same configuration\n"
       << "  round trip      stiffness   in free motion like a " << (waves ? "mass" : "damper") << " of\n";
  for (const int ms : {2, 10, 50, 200, 600}) {
    const double loop = ms * 1e-3;
    if (waves) {
      const double way = loop / 2 + seconds(WaveLaw::kLineWaits);
      text << std::setw(9) << ms << " ms" << std::setw(11) << std::llround(spring.own_damping / way) << " N/m"
           << std::setw(11) << std::setprecision(3) << spring.own_damping * way << " kg\n";
      continue;
    }
    const double quiet = spring.adapt_to_delay ? 2 * spring.own_damping / loop : spring.stiffness;
    const double stiffness = std::min(spring.stiffness, quiet);
    text << std::setw(9) << ms << " ms" << std::setw(11) << std::llround(stiffness) << " N/m" << std::setw(11)
         << std::setprecision(3) << stiffness * loop + 2 * spring.own_damping << " N·s/m\n";
  }
}

std::string spoken_here(const Suites& wanted) {
  Suites here = suites_of_this_machine();
  std::erase_if(here, [&](Suite suite) { return !contains(wanted, suite); });
  if (here.empty()) return "no cipher that this processor supports: it has no AES instructions";
  const bool lacks_one = contains(wanted, Suite::kAesGcm) && !contains(here, Suite::kAesGcm);
  return names_of(here) + (lacks_one ? " (this processor has no AES instructions)" : "");
}

std::string when_frozen(const Driver& driver) {
  if (!driver.moves_a_hand) return "";
  const std::string device =
      "If the server and its guardian are frozen (docker pause): the " + std::string(driver.name);
  if (driver.watchdog == Duration::zero()) return device + " keeps its last force";
  return device + " removes the force after " + std::to_string(driver.watchdog / std::chrono::milliseconds(1)) +
         " ms with its own watchdog";
}

}  // namespace

std::string in_words(const Scene& scene, const Explanation& explanation) {
  const auto [parts, step_ns, device_ns, resolution_ns] = explanation;
  std::size_t width = 0;
  for (const auto& part : parts) width = std::max(width, part.key.size());
  std::ostringstream text;
  text << scene.name << ": one haptic step every " << seconds(scene.loop.period) * 1e6 << " µs, limiter "
       << info(scene.loop.control.limiter.law).name << '\n';
  const auto put = [&](const std::string& heading, const auto& belongs, bool with_cost) {
    if (std::ranges::none_of(explanation.parts, belongs)) return;
    text << heading << ":\n";
    for (const auto& part : explanation.parts) {
      if (!belongs(part)) continue;
      text << "  " << std::left << std::setw(static_cast<int>(width)) << part.key << std::right << std::setw(10)
           << (with_cost ? std::to_string(std::llround(*part.cost_ns)) + " ns" : "") << "   " << part.what << '\n';
    }
  };
  using Part = Explanation::Part;
  const auto shows = [least = resolution_ns](double ns) { return std::abs(ns) >= least; };
  put(
      "On, with the cost per step", [&](const Part& part) { return part.cost_ns && shows(*part.cost_ns); }, true);
  put(
      "On, with a cost below the " + std::to_string(std::llround(std::ceil(resolution_ns))) +
          " ns that can be measured on this machine",
      [&](const Part& part) { return part.cost_ns && !shows(*part.cost_ns); }, false);
  put(
      "Off in this scene", [](const Part& part) { return !part.cost_ns; }, false);
  text << "Whole step: " << std::llround(step_ns) << " ns of processor time, including " << std::llround(device_ns)
       << " ns for the simulated device"
       << (!std::holds_alternative<SimulatedDevice::Config>(scene.device) ? " that replaces the real device" : "")
       << "; measured on this machine just now, ± " << std::llround(std::ceil(resolution_ns)) << " ns\n";
  if (scene.count > 1) {
    const double share = 1e-9 * step_ns * scene.count / seconds(scene.loop.period);
    text << "device.count: " << scene.count << " devices, " << scene.name_of(0) << " to "
         << scene.name_of(scene.count - 1) << "; their steps take " << std::llround(100 * share)
         << " % of a processor; each device requires 1 MB of memory, without a recording\n";
  }
  if (scene.has_fields()) put_fields(scene, text);
  if (const auto& coupling = scene.loop.control.coupling) put_coupling(*coupling, scene.loop.control.limiter, text);
  for (const CoupledLeader& leader : scene.loop.control.leaders) {
    text << "  " << scene.channels[leader.channel].name << " has a share of " << leader.share << "\n";
  }
  text << "Guarantee of the limiter: " << promise_of(scene.loop.control.limiter) << '\n';
  text << "Haptic thread: "
       << (scene.shares_thread() ? "shared with all devices without a plug that have the same period and processor\n"
                                 : "a separate thread, so that other devices do not wait for its USB transfers\n");
  if (const std::string frozen = when_frozen(scene.driver()); !frozen.empty()) text << frozen << '\n';
  text << "Other threads: " << scene.channels.size() << (scene.channels.size() == 1 ? " channel" : " channels")
       << " for engines" << (scene.network.keys ? ", encrypted with " + spoken_here(scene.network.suites) : "") << ", "
       << (scene.recording ? "a recording" : "no recording")
       << (scene.discovery && scene.discovery->announce ? ", announced on the network" : "") << '\n';
  if (scene.network.busy)
    text << "network.busy: the network thread polls instead of sleeping, and always uses a whole processor\n";
  if (scene.network.dscp)
    text
        << "network.dscp: datagrams are marked with EF (46), for routers and switches that are configured for it. Over "
           "Wi-Fi, many kernels send them like video, unless the access point maps EF to voice\n";
  return text.str();
}

std::string in_json(const Scene& scene, const Explanation& explanation) {
  using Json = nlohmann::ordered_json;
  Json out = {{"device", scene.name},
              {"count", scene.count},
              {"period_us", seconds(scene.loop.period) * 1e6},
              {"promise", promise_of(scene.loop.control.limiter)},
              {"step_ns", explanation.step_ns},
              {"device_ns", explanation.device_ns},
              {"resolution_ns", explanation.resolution_ns},
              {"sealed_by", scene.network.keys ? Json(spoken_here(scene.network.suites)) : Json(nullptr)},
              {"network_busy", scene.network.busy},
              {"network_dscp", scene.network.dscp ? Json(static_cast<int>(*scene.network.dscp)) : Json(nullptr)},
              {"parts", Json::array()}};
  for (const auto& part : explanation.parts) {
    out["parts"].push_back({{"key", part.key},
                            {"listed", part.cost_ns.has_value()},
                            {"cost_ns", part.cost_ns ? Json(*part.cost_ns) : Json(nullptr)}});
  }
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace tendon
