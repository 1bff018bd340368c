// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/falcon_loop.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <sstream>
#include <thread>
#include <vector>

#include "devices/falcon/falcon_device.h"
#include "devices/usb/usb.h"
#include "server/clock.h"
#include "server/haptic_loop.h"
#include "tests/devices/usb/usbfs_shim.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;

constexpr double kWall = 500;  // N/m

double quantile_us(std::vector<Duration>& times, double share) {
  if (times.empty()) return 0;
  const auto at = times.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(times.size() - 1));
  std::nth_element(times.begin(), at, times.end());
  return seconds(*at) * 1e6;
}

/// How late a thread is that does nothing else but sleep.
class Floor {
 public:
  explicit Floor(std::size_t most) {
    late_.reserve(most);
    thread_ = std::thread([this] {
      for (LocalTime due = clock::now() + 1ms; !stop_.load(); due = std::max(due + 1ms, clock::now())) {
        clock::sleep_until(due);
        if (late_.size() < late_.capacity()) late_.push_back(clock::now() - due);
      }
    });
  }
  std::vector<Duration>& finish() {
    stop_ = true;
    thread_.join();
    return late_;
  }

 private:
  std::atomic<bool> stop_{false};
  std::vector<Duration> late_;
  std::thread thread_;
};

RemoteForce answer(const DeviceState& state, std::uint64_t number, LocalTime now) {
  RemoteForce force;
  force.sequence = number;
  force.received = force.answers = now;
  const bool inside = state.position.x() > 0;
  force.force = Vec3(inside ? -kWall * state.position.x() : 0, 0, 0);
  force.model = LocalModel{state.position, Mat3(Vec3(inside ? kWall : 0, 0, 0).asDiagonal())};
  force.valid_for = 30ms;
  return force;
}

bool near(const Vec3& felt, const Vec3& written) { return (felt - written).norm() <= 0.1 + 0.2 * written.norm(); }

}  // namespace

FalconLoopReport run_falcon_loop(Duration duration, Law limiter, const std::function<std::uint64_t()>& heap_calls_now) {
  UsbfsShim shim({.has_firmware = true, .is_homed = true});
  FalconDevice device({}, usb::open_pipe({.node = [&shim] { return shim.node(); }}));
  while (device.state() != Device::State::kHomed) {
    device.read(clock::now());
    device.apply(Vec3::Zero());
    clock::sleep_until(clock::now() + 1ms);
  }

  HapticLoop::Config config;
  config.control.limiter.law = limiter;
  config.control.limiter.friction = {.coulomb = 0.3, .viscous = 0.5};
  config.control.limiter.longest_hold = 2ms;
  config.control.max_force = 8;
  config.control.max_slew = 1000;
  const auto mail = std::make_unique<Mailboxes>();
  HapticLoop loop(config, device, *mail);

  FalconLoopReport report;
  const auto most = static_cast<std::size_t>(duration / 1ms + 1);
  std::vector<Duration> late;
  std::vector<Duration> work;
  late.reserve(most);
  work.reserve(most);
  double shares = 0;
  std::uint64_t deep = 0;
  bool seen = false;
  Vec3 written = Vec3::Zero();
  Floor floor(most);
  const LocalTime begin = clock::now();
  for (LocalTime due = begin; due < begin + duration;) {
    clock::sleep_until(due);
    const LocalTime now = clock::now();
    const double x = 0.02 * std::sin(std::numbers::pi * seconds(now - begin));
    shim.with([x](FakeFalcon& falcon) { falcon.move_to(falcon::kCentre + Vec3(x, 0, 0)); });
    const std::uint64_t before = heap_calls_now ? heap_calls_now() : 0;
    const LocalTime next = loop.step(now);
    if (heap_calls_now) report.heap_calls += heap_calls_now() - before;
    late.push_back(now - due);
    work.push_back(clock::now() - now);
    report.missed += static_cast<std::uint64_t>((next - due) / 1ms - 1);
    due = next;
    const bool seen_before = seen;
    const Vec3 written_before = written;
    while (const StepRecord* step = mail->steps.front()) {
      report.least_energy = std::min(report.least_energy, step->energy);
      seen = !step->reasons.has(Reason::kUnseen);
      written = step->applied;
      mail->steps.pop();
    }
    if (++report.steps % 10 == 0) {
      if (const DeviceState* state = mail->state.take()) mail->forces[0].put(answer(*state, report.steps, now));
    }
    if (x > 0.005) {
      const Vec3 felt = shim.with([](FakeFalcon& falcon) { return falcon.force(); });
      shares += felt.x() / (-kWall * x);
      ++deep;
      if (seen && seen_before) {
        ++report.checked;
        if (!near(felt, written) && !near(felt, written_before)) ++report.at_odds;
        if (felt.x() < -1) ++report.pushed;
      }
    }
  }
  loop.stop();
  report.unseen = loop.stats().unseen;
  report.overruns = loop.stats().overruns;
  report.late_p50_us = quantile_us(late, 0.5);
  report.late_p99_us = quantile_us(late, 0.99);
  report.work_p50_us = quantile_us(work, 0.5);
  auto& slept = floor.finish();
  report.floor_p50_us = quantile_us(slept, 0.5);
  report.floor_p99_us = quantile_us(slept, 0.99);
  report.wall_share = deep > 0 ? shares / static_cast<double>(deep) : 0;
  return report;
}

std::string FalconLoopReport::json() const {
  std::ostringstream text;
  text << "{\"steps\":" << steps << ",\"missed\":" << missed << ",\"unseen\":" << unseen << ",\"overruns\":" << overruns
       << ",\"late_p50_us\":" << late_p50_us << ",\"late_p99_us\":" << late_p99_us
       << ",\"floor_p50_us\":" << floor_p50_us << ",\"floor_p99_us\":" << floor_p99_us
       << ",\"work_p50_us\":" << work_p50_us << ",\"wall_share\":" << wall_share << ",\"checked\":" << checked
       << ",\"at_odds\":" << at_odds << ",\"pushed\":" << pushed << ",\"least_energy_j\":" << least_energy << "}";
  return text.str();
}

}  // namespace tendon
