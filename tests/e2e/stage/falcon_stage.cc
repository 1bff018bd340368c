// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/stage/falcon_stage.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "devices/falcon/kinematics.h"
#include "devices/falcon/packet.h"
#include "server/machine/clock.h"
#include "tests/devices/falcon/fake_firmware.h"

namespace tendon::e2e {
namespace {

using namespace std::chrono_literals;

constexpr double kOutside = -0.015;     // m
constexpr double kPressed = 0.004;      // m
constexpr std::uint8_t kCentreKey = 4;  // button 2, the deadman switch of the scene
constexpr auto kLook = 1ms;

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// This is deploy/scenes/falcon.toml after `tendon-identify`, with encrypted sessions.
std::string falcon_scene() {
  std::string text = text_of(std::filesystem::path(TENDON_SCENES) / "falcon.toml");
  const auto set = [&text](const std::string& key, const std::string& value) {
    const auto found = text.find("\n" + key + " = ");
    if (found == std::string::npos) throw std::runtime_error("falcon.toml has no " + key);
    const auto begin = found + key.size() + 4;
    text.replace(begin, text.find('\n', begin) - begin, value);
  };
  set("coulomb_friction_n", "0.3");
  set("viscous_friction_n_s_per_m", "0.5");
  return text + "\n[network]\nkeys = \"keys\"\n";
}

}  // namespace

FalconStage::FalconStage(const Config& config)
    : scene_(write(folder_.path() / "falcon.toml", falcon_scene())),
      falcon_(config.falcon, folder_.path()),
      wanted_x_(kOutside),
      x_(kOutside) {
  const auto firmware = fake_firmware(config.falcon.firmware_bytes);
  const std::string firmware_file =
      write(folder_.path() / "firmware.bin", {reinterpret_cast<const char*>(firmware.data()), firmware.size()});
  std::filesystem::create_directory(folder_.path() / "keys");
  Process keygen(program("tendond"), {"keygen", "wall", "--out", "keys/wall.key"}, folder_.path());
  if (keygen.wait() != 0) throw std::runtime_error("no key: " + keygen.err());

  falcon_.set_user([this](FakeFalcon& falcon, LocalTime now) { use(falcon, now); });
  std::vector<std::string> arguments = {"--falcon-firmware", firmware_file, "--accept-unknown-firmware"};
  if (config.record) arguments.insert(arguments.end(), {"--record", recording().string()});
  server_.emplace(folder_.path(), scene_, std::move(arguments), falcon_.environment());
  wall_.emplace("virtual_wall", server_->address(), folder_.path(),
                std::vector<std::string>{"--key", "keys/wall.key", "--stiffness-n-per-m", std::to_string(kWall),
                                         "--local-model"});
}

Scene FalconStage::scene() const { return read_scene(scene_); }

void FalconStage::use(FakeFalcon& falcon, LocalTime now) {
  // The position does not jump after a pause of the machine.
  const double most = speed_ * std::min(used_ ? seconds(now - *used_) : 0.0, 2e-3);
  used_ = now;
  const double x = x_ + std::clamp(wanted_x_ - x_, -most, most);
  falcon.move_to(falcon::kCentre + Vec3(x, 0, 0));
  falcon.press(button_ ? kCentreKey : 0);
  if (homes_ && !falcon.homed()) falcon.pull_through();
  x_ = x;
  if (x <= kDeep) return;
  const std::lock_guard lock(mutex_);
  ++felt_.rounds;
  felt_.nothing += falcon.pushes() ? 0 : 1;
  felt_.share += falcon.force().x() / (-kWall * x);
}

void FalconStage::go_to(double x, double speed) {
  speed_ = speed;
  wanted_x_ = x;
  wait_until([this, x](const FakeFalcon&) { return x_ == x; }, "the hand's way");
}

void FalconStage::arm() {
  wait_until([](const FakeFalcon& falcon) { return falcon.lamps() == falcon::kGreen; }, "green lamps");
  button_ = false;
  go_to(kOutside);
  wait_for_commands(20);  // time to detect that the button is released
  button_ = true;
  wait_for_commands(600);  // 50 at rest, and then the ramp
}

void FalconStage::arm_and_press() {
  arm();
  go_to(kPressed);
  wait_until(pushed_out, "the wall");
}

void FalconStage::wait_for_commands(int count) {
  const int heard = falcon_.with([](const FakeFalcon& falcon) { return falcon.commands(); });
  wait_until([heard, count](const FakeFalcon& falcon) { return falcon.commands() >= heard + count; },
             std::to_string(count) + " commands");
}

FarFalcon::Seen FalconStage::wait_for_release() {
  for (const LocalTime end = clock::now() + kPatience; clock::now() < end; std::this_thread::sleep_for(kLook)) {
    if (FarFalcon::Seen seen = falcon_.seen(); !seen.open) return seen;
  }
  throw std::runtime_error("somebody keeps the device open");
}

FalconStage::Killed FalconStage::kill_server() {
  const LocalTime killed = clock::now();
  server_->process().signal(SIGKILL);
  if (server_->process().wait() != -SIGKILL) throw std::runtime_error("the server was not killed");
  const double dead_ms = seconds(clock::now() - killed) * 1e3;
  const FarFalcon::Seen seen = wait_for_release();
  Killed result{.dead_ms = dead_ms,
                .pushes = falcon_.with([](const FakeFalcon& falcon) { return falcon.pushes(); }),
                .last = seen.last,
                .by_guardian = seen.by_node};
  if (seen.let_go && *seen.let_go > killed) result.pushed_for_ms = seconds(*seen.let_go - killed) * 1e3;
  return result;
}

double FalconStage::released_after(int signal, std::optional<pid_t> process) {
  const LocalTime sent = clock::now();
  ::kill(process.value_or(server_->process().pid()), signal);
  wait_until([](const FakeFalcon& falcon) { return !falcon.pushes(); }, "no force");
  const FarFalcon::Seen seen = falcon_.seen();
  return seen.let_go && *seen.let_go > sent ? seconds(*seen.let_go - sent) * 1e3 : 0;
}

bool FalconStage::machine_stood_still() {
  return falcon_.seen().longest_gap > 10ms ||
         server_->process().err().find(" overruns in the last") != std::string::npos;
}

void FalconStage::wait_until(const std::function<bool(const FakeFalcon&)>& what, const std::string& name) {
  for (const auto end = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < end;) {
    if (falcon_.with(what)) return;
    std::this_thread::sleep_for(kLook);
  }
  throw std::runtime_error("waited in vain for: " + name + "\n--- tendond's stderr:\n" + server_->process().err());
}

}  // namespace tendon::e2e
