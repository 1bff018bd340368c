// SPDX-License-Identifier: Apache-2.0
#include "server/commands/explain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <memory>
#include <sstream>
#include <utility>

namespace tendon {
namespace {

constexpr int kSteps = 200;  ///< of a round

/// Something that a scene lists or does not.
struct Listable {
  std::string_view key;
  std::string_view what;
  bool (*listed)(const Scene&);
  void (*drop)(Scene&);
};

constexpr std::array kListables = {
    Listable{"device.hand", "the operator: a spring, a damper and a mass",
             [](const Scene& scene) { return scene.device.hand.has_value(); },
             [](Scene& scene) { scene.device.hand.reset(); }},
    Listable{"device.effects.viscous_friction_n_s_per_m", "true viscous friction",
             [](const Scene& scene) { return scene.device.viscous_friction.has_value(); },
             [](Scene& scene) { scene.device.viscous_friction.reset(); }},
    Listable{"device.effects.coulomb_friction_n", "true Coulomb friction",
             [](const Scene& scene) { return scene.device.coulomb_friction.has_value(); },
             [](Scene& scene) { scene.device.coulomb_friction.reset(); }},
    Listable{"device.effects.joint_friction", "friction of each joint, by the pose",
             [](const Scene& scene) { return scene.device.joint_friction.has_value(); },
             [](Scene& scene) { scene.device.joint_friction.reset(); }},
    Listable{"device.effects.structural_mode", "the handle on a spring",
             [](const Scene& scene) { return scene.device.structural_mode.has_value(); },
             [](Scene& scene) { scene.device.structural_mode.reset(); }},
    Listable{"device.effects.sample_delay_ms", "positions come late",
             [](const Scene& scene) { return scene.device.sample_delay.has_value(); },
             [](Scene& scene) { scene.device.sample_delay.reset(); }},
    Listable{"device.effects.force_delay_ms", "forces reach the motors late",
             [](const Scene& scene) { return scene.device.force_delay.has_value(); },
             [](Scene& scene) { scene.device.force_delay.reset(); }},
    Listable{"device.effects.encoder_step_um", "positions in counts",
             [](const Scene& scene) { return scene.device.encoder_step.has_value(); },
             [](Scene& scene) { scene.device.encoder_step.reset(); }},
    Listable{"device.effects.max_force_n", "the device's own saturation",
             [](const Scene& scene) { return scene.device.max_force.has_value(); },
             [](Scene& scene) { scene.device.max_force.reset(); }},
    Listable{"device.effects.amplifier_bandwidth_hz", "motors that lag behind the command",
             [](const Scene& scene) { return scene.device.amplifier_bandwidth.has_value(); },
             [](Scene& scene) { scene.device.amplifier_bandwidth.reset(); }},
    Listable{"device.effects.force_sensor", "measures the hand's force; what admittance needs",
             [](const Scene& scene) { return scene.device.force_sensor.has_value(); },
             [](Scene& scene) { scene.device.force_sensor.reset(); }},
    Listable{"device.effects.watchdog_ms", "lets go when no command comes",
             [](const Scene& scene) { return scene.device.watchdog.has_value(); },
             [](Scene& scene) { scene.device.watchdog.reset(); }},
    Listable{"loop.max_speed_m_per_s", "a position that no hand comes to is a fault",
             [](const Scene& scene) { return scene.loop.control.max_speed.has_value(); },
             [](Scene& scene) { scene.loop.control.max_speed.reset(); }},
    Listable{"safety", "no force unless armed, and none after a fault",
             [](const Scene& scene) { return scene.safety.has_value(); }, [](Scene& scene) { scene.safety.reset(); }},
    Listable{"safety.force_limit", "no force is longer",
             [](const Scene& scene) { return scene.safety && scene.safety->force_limit.has_value(); },
             [](Scene& scene) { scene.safety->force_limit.reset(); }},
    Listable{"safety.growth_limit", "no force grows faster",
             [](const Scene& scene) { return scene.safety && scene.safety->growth_limit.has_value(); },
             [](Scene& scene) { scene.safety->growth_limit.reset(); }},
    Listable{"safety.ramp_in", "forces begin slowly after arming",
             [](const Scene& scene) { return scene.safety && scene.safety->ramp_in.has_value(); },
             [](Scene& scene) { scene.safety->ramp_in.reset(); }},
    Listable{"safety.heat_limit", "motors do not burn",
             [](const Scene& scene) { return scene.safety && scene.safety->heat_limit.has_value(); },
             [](Scene& scene) { scene.safety->heat_limit.reset(); }},
    Listable{"safety.workspace", "nothing pushes the hand out of it",
             [](const Scene& scene) { return scene.safety && scene.safety->workspace.has_value(); },
             [](Scene& scene) { scene.safety->workspace.reset(); }},
    Listable{"safety.speed_trip", "a handle that flies gets no force",
             [](const Scene& scene) { return scene.safety && scene.safety->speed_trip.has_value(); },
             [](Scene& scene) { scene.safety->speed_trip.reset(); }},
    Listable{"safety.step_bound", "encoders that wrap or lose count unarm",
             [](const Scene& scene) { return scene.safety && scene.safety->step_bound.has_value(); },
             [](Scene& scene) { scene.safety->step_bound.reset(); }},
    Listable{"safety.command_watchdog", "a loop that stood still is not gone on with",
             [](const Scene& scene) { return scene.safety && scene.safety->command_watchdog.has_value(); },
             [](Scene& scene) { scene.safety->command_watchdog.reset(); }},
    Listable{"safety.link_watchdog", "nor a device that was silent",
             [](const Scene& scene) { return scene.safety && scene.safety->link_watchdog.has_value(); },
             [](Scene& scene) { scene.safety->link_watchdog.reset(); }},
    Listable{"safety.dead_man", "no force unless the button is held",
             [](const Scene& scene) { return scene.safety && scene.safety->dead_man.has_value(); },
             [](Scene& scene) { scene.safety->dead_man.reset(); }},
    Listable{"limiter", "keeps the device from giving out energy",
             [](const Scene& scene) { return scene.loop.control.limiter.law != Law::kNone; },
             [](Scene& scene) { scene.loop.control.limiter.law = Law::kNone; }},
    Listable{"limiter.energy_cap", "credit is capped",
             [](const Scene& scene) { return scene.loop.control.limiter.parts.energy_cap.has_value(); },
             [](Scene& scene) { scene.loop.control.limiter.parts.energy_cap.reset(); }},
    Listable{"limiter.robust_ledger", "rounding of positions earns nothing",
             [](const Scene& scene) { return scene.loop.control.limiter.parts.robust_ledger.has_value(); },
             [](Scene& scene) { scene.loop.control.limiter.parts.robust_ledger.reset(); }},
    Listable{"limiter.knee", "no hard edge where the limiter begins",
             [](const Scene& scene) { return scene.loop.control.limiter.parts.knee.has_value(); },
             [](Scene& scene) { scene.loop.control.limiter.parts.knee.reset(); }},
    Listable{"limiter.latency_reserve", "forces under way are paid for",
             [](const Scene& scene) { return scene.loop.control.limiter.parts.latency_reserve.has_value(); },
             [](Scene& scene) { scene.loop.control.limiter.parts.latency_reserve.reset(); }},
    Listable{"limiter.bounded_acceleration", "for devices with next to no damping",
             [](const Scene& scene) { return scene.loop.control.limiter.parts.bounded_acceleration.has_value(); },
             [](Scene& scene) { scene.loop.control.limiter.parts.bounded_acceleration.reset(); }},
    Listable{"limiter.adaptive_friction", "friction bounds by place",
             [](const Scene& scene) { return scene.loop.control.limiter.parts.adaptive_friction.has_value(); },
             [](Scene& scene) {
               scene.loop.control.limiter.parts.adaptive_friction.reset();
               scene.loop.control.friction_map.reset();
             }},
    Listable{"admittance", "the handle follows a tool of another mass",
             [](const Scene& scene) { return scene.loop.control.admittance.has_value(); },
             [](Scene& scene) { scene.loop.control.admittance.reset(); }},
    Listable{"force.adaptive_local_model", "models of the engine are blended and capped",
             [](const Scene& scene) { return scene.loop.control.hold.adaptive_local_model.has_value(); },
             [](Scene& scene) { scene.loop.control.hold.adaptive_local_model.reset(); }},
    Listable{"force.output_estimator", "the environment is learnt from its answers",
             [](const Scene& scene) { return scene.loop.control.hold.output_estimator.has_value(); },
             [](Scene& scene) { scene.loop.control.hold.output_estimator.reset(); }},
};

/// A scene that runs, without a thread and without a network.
class Trial {
 public:
  explicit Trial(const Scene& scene)
      : device_(scene.device),
        safe_(made_safe(scene, device_)),
        loop_(scene.loop, safe_ ? static_cast<Device&>(*safe_) : device_, *mail_),
        period_(scene.loop.period) {}

  /// ns of a step, mean of kSteps.
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

  /// The same of the device alone.
  double device(const std::function<Duration()>& processor_time) {
    const Duration before = processor_time();
    for (int i = 0; i < kSteps; ++i) {
      const auto sample = device_.read(now_);
      device_.apply(sample ? Vec3(kStiffness * sample->position) : Vec3(Vec3::Zero()));
      now_ += period_;
    }
    return per_step(processor_time() - before);
  }

 private:
  static constexpr double kStiffness = -500;  // N/m

  static double per_step(Duration total) { return static_cast<double>(total.count()) / kSteps; }

  /// Armed as soon as may be: what is to be measured is what its parts cost at work.
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

  SimulatedDevice device_;
  std::unique_ptr<SafeDevice> safe_;  ///< null when the scene lists none
  std::unique_ptr<Mailboxes> mail_ =
      std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 2, .flight = 2, .datagrams = 1});
  HapticLoop loop_;
  Duration period_;
  LocalTime now_{std::chrono::seconds(1)};
  std::uint64_t step_ = 0;
};

/// The least of several measurements, and how far it can be trusted: what the odd ones and the even ones differ by.
class Least {
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

std::string rounded(double ns, double resolution) {
  std::ostringstream text;
  if (std::abs(ns) < resolution) {
    text << "< " << std::llround(std::ceil(resolution));
  } else {
    text << std::llround(ns);
  }
  text << " ns";
  return text.str();
}

}  // namespace

Explanation explain(const Scene& scene, const std::function<Duration()>& processor_time, int rounds) {
  Explanation out;
  std::vector<std::unique_ptr<Trial>> trials;  // the whole scene, the same again, and one for each part that it lists
  trials.push_back(std::make_unique<Trial>(scene));
  trials.push_back(std::make_unique<Trial>(scene));
  std::vector<std::size_t> part_of;
  for (const Listable& each : kListables) {
    out.parts.push_back({each.key, each.what, {}});
    if (!each.listed(scene)) continue;
    Scene less = scene;
    each.drop(less);
    trials.push_back(std::make_unique<Trial>(less));
    part_of.push_back(out.parts.size() - 1);
  }
  Trial device(scene);
  Least device_alone;
  std::vector<Least> least(trials.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < trials.size(); ++i) least[i].add(trials[i]->steps(processor_time));
    device_alone.add(device.device(processor_time));
  }
  out.step_ns = least[0].value();
  out.device_ns = device_alone.value();
  out.resolution_ns = std::abs(least[0].value() - least[1].value());
  for (const Least& one : least) out.resolution_ns = std::max(out.resolution_ns, one.doubt());
  for (std::size_t i = 0; i < part_of.size(); ++i) {
    out.parts[part_of[i]].cost_ns = out.step_ns - least[i + 2].value();
  }
  return out;
}

std::string in_words(const Scene& scene, const Explanation& explanation) {
  const auto [parts, step_ns, device_ns, resolution_ns] = explanation;
  std::size_t width = 0;
  for (const auto& part : parts) width = std::max(width, part.key.size());
  std::ostringstream text;
  text << scene.name << ": a haptic step each " << seconds(scene.loop.period) * 1e6 << " µs, limiter "
       << info(scene.loop.control.limiter.law).name << "\nruns, and adds to a step:\n";
  for (const auto& part : parts) {
    if (!part.cost_ns) continue;
    text << "  " << std::left << std::setw(static_cast<int>(width)) << part.key << std::right << std::setw(10)
         << rounded(*part.cost_ns, resolution_ns) << "   " << part.what << '\n';
  }
  text << "is not listed, and does not exist:\n";
  for (const auto& part : parts) {
    if (!part.cost_ns)
      text << "  " << std::left << std::setw(static_cast<int>(width)) << part.key << "             " << part.what
           << '\n';
  }
  text << "a whole step: " << std::llround(step_ns) << " ns of processor time, of which " << std::llround(device_ns)
       << " ns are the simulated device"
       << (scene.moves_a_hand() || !scene.exerts_force() ? ", which stands in for the real one" : "")
       << "; measured here and now, ± " << std::llround(std::ceil(resolution_ns)) << " ns\n"
       << "in other threads: " << scene.channels.size() << (scene.channels.size() == 1 ? " channel" : " channels")
       << " for engines" << (scene.network.keys ? ", sealed" : "") << ", "
       << (scene.recording ? "a recording" : "no recording") << '\n';
  return text.str();
}

std::string in_json(const Scene& scene, const Explanation& explanation) {
  std::ostringstream text;
  text << "{\"device\":\"" << scene.name << "\",\"period_us\":" << seconds(scene.loop.period) * 1e6
       << ",\"step_ns\":" << explanation.step_ns << ",\"device_ns\":" << explanation.device_ns
       << ",\"resolution_ns\":" << explanation.resolution_ns << ",\"parts\":[";
  for (const auto& part : explanation.parts) {
    text << (&part == explanation.parts.data() ? "" : ",") << "{\"key\":\"" << part.key
         << "\",\"listed\":" << (part.cost_ns ? "true" : "false") << ",\"cost_ns\":";
    if (part.cost_ns) {
      text << *part.cost_ns << '}';
    } else {
      text << "null}";
    }
  }
  text << "]}";
  return text.str();
}

}  // namespace tendon
