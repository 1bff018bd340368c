// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/fleet.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/machine/clock.h"
#include "server/scene/key_folder.h"
#include "tests/server/scratch_folder.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/fleet_guests.h"
#include "tests/tools/bench/other_process.h"
#include "tests/tools/bench/server_process.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;
namespace fs = std::filesystem;

constexpr Duration kPatience = std::chrono::seconds(20);

std::string scene_of(const Fleet& fleet, const fs::path& recording) {
  std::string text = "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\nsubstep_us = 1000\nname = \"" +
                     std::string(kFleetName) + "\"\ncount = " + std::to_string(fleet.devices) +
                     "\n[device.hand]\nstiffness_n_per_m = 300\ndamping_n_s_per_m = 3\nmass_kg = 0.05\n"
                     "[device.hand.motion]\nkind = \"sine\"\namplitude_mm = 15\nfrequency_hz = 0.5\n"
                     "[limiter]\ncoulomb_friction_n = 0.3\nviscous_friction_n_s_per_m = 0.8\n";
  for (std::size_t c = 0; c < fleet.channels; ++c) text += "[[channel]]\nname = \"" + channel_name(c) + "\"\n";
  text += "[network]\nlisten = \"127.0.0.1:0\"\nkeys = \"keys\"\nmax_observers = 1000\n";
  if (fleet.recorded) text += "[recording]\npath = \"" + recording.string() + "\"\n";
  return text;
}

fs::path written_in(const fs::path& folder, const Fleet& fleet, const std::vector<Plan>& plans) {
  fs::create_directory(folder / "keys");
  for (std::size_t i = 0; i < plans.size(); ++i) {
    const std::string name = "k" + std::to_string(i);
    write_key_file(folder / "keys" / (name + ".key"), {.name = name, .role = Role::kController, .key = *plans[i].key});
  }
  const fs::path scene = folder / "scene.toml";
  std::ofstream(scene) << scene_of(fleet, folder / "run.mcap");
  return scene;
}

class Trial {
 public:
  explicit Trial(const Fleet& fleet)
      : fleet_(fleet),
        secrets_(fleet.seed),
        plans_(plans_of(fleet, secrets_)),
        server_(written_in(folder_.path(), fleet, plans_), fleet.priority) {
    guests_.emplace([&] { serve_guests(plans_, server_.address(), fleet_, *shared_); });
  }
  ~Trial() {
    shared_->phase.store(Shared::kQuit, std::memory_order_release);
    guests_.reset();
  }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;

  FleetResult run() {
    result_.started = server_.started();
    await_sessions();
    if (!result_.all_came) return result_;
    measure();
    shared_->phase.store(Shared::kQuit, std::memory_order_release);
    guests_.reset();
    take_totals(server_.stop());
    return result_;
  }

 private:
  void await_sessions() {
    const LocalTime began = clock::now();
    while (shared_->open.load(std::memory_order_acquire) < plans_.size() && clock::now() - began < kPatience) {
      guests_->check();
      server_.check();
      clock::sleep_until(clock::now() + milliseconds(10));
    }
    result_.sessions = shared_->open;
    result_.all_came = result_.sessions == plans_.size();
  }

  void wait_for(int phase) {
    shared_->phase.store(phase, std::memory_order_release);
    for (const LocalTime began = clock::now(); shared_->at_work.load(std::memory_order_acquire) != phase;) {
      guests_->check();
      if (clock::now() - began > kPatience) throw std::runtime_error("the guests do not answer");
      clock::sleep_until(clock::now() + milliseconds(1));
    }
  }

  void measure() {
    clock::sleep_until(clock::now() + fleet_.settle);
    wait_for(Shared::kMeasuring);
    const LocalTime start = clock::now();
    const ServerProcess::Spent before = server_.spent();
    const Duration guests_before = guests_->processor_time();
    clock::sleep_until(start + fleet_.length);
    while (shared_->states == 0 && clock::now() - start < kPatience) clock::sleep_until(clock::now() + milliseconds(1));
    const ServerProcess::Spent after = server_.spent();
    result_.guests = guests_->processor_time() - guests_before;
    wait_for(Shared::kReporting);
    result_.seconds = seconds(shared_->until - shared_->from);
    result_.resident = server_.resident();
    result_.haptic = after.haptic - before.haptic;
    result_.network = after.network - before.network;
    result_.log = after.rest - before.rest;
    result_.out_datagrams = shared_->out_datagrams;
    result_.out_bytes = shared_->out_bytes;
    result_.in_datagrams = shared_->in_datagrams;
    result_.in_bytes = shared_->in_bytes;
    result_.state_age = shared_->state_age;
    result_.loop_age = shared_->loop_age;
    result_.states_received = shared_->states;
    result_.answered_in_time = shared_->answered_in_time;
    result_.lost = shared_->lost;
    std::size_t seen = 0;
    for (const Plan& plan : plans_) {
      seen += plan.claims.size();
      result_.controllers += plan.controls ? 1 : 0;
    }
    result_.states_owed = static_cast<std::uint64_t>(result_.seconds * static_cast<double>(seen) * fleet_.state_hz);
    result_.steps_owed =
        static_cast<std::uint64_t>(result_.seconds / seconds(kPeriod) * static_cast<double>(fleet_.devices));
  }

  void take_totals(const std::string& stopped) {
    const auto line = nlohmann::json::parse(stopped);
    result_.steps = line.at("steps");
    result_.overruns = line.at("overruns");
    result_.forces_taken = line.at("forces");
    result_.lost_steps = line.value("lost_steps", std::uint64_t{0});
    result_.forces_sent = shared_->forces_sent;
  }

  Fleet fleet_;
  Ratchet secrets_;
  std::vector<Plan> plans_;
  testing::ScratchFolder folder_;
  SharedMemory<Shared> shared_;
  ServerProcess server_;
  std::optional<OtherProcess> guests_;
  FleetResult result_;
};

}  // namespace

FleetResult run_fleet(const Fleet& fleet) {
  raise_file_limit();
  return Trial(fleet).run();
}

}  // namespace tendon::bench
