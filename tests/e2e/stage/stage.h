// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "server/recording/records.h"
#include "server/scene/scene.h"
#include "tests/e2e/stage/process.h"

namespace tendon::e2e {

/// tendond, tendon-inject, virtual_wall …
std::filesystem::path program(const std::string& name);

std::filesystem::path demo_scene();

/// In this scene, the hand is moved into the wall and is then held there. Forces are held and faded for longer than the
/// pauses of a machine, so that every stage of the age policy is tested.
inline constexpr std::string_view kPressingHand = R"([device]
kind = "simulated"
profile = "falcon"

[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05

[device.hand.motion]
kind = "ramp-hold"
from_mm = [-10, 0, 0]
to_mm = [15, 0, 0]
ramp_ms = 300

[force]
hold_ms = 200
safe_stop_ms = 1000
)";

/// Returns the path for a command line.
std::string write(const std::filesystem::path& file, std::string_view text);

/// Returns the number for `key`, or the first one of an array. Throws std::runtime_error if it does not exist.
double number_in(std::string_view json, const std::string& key);
std::uint64_t count_in(std::string_view json, const std::string& key);
/// The text must not contain any escapes.
std::string text_in(std::string_view json, const std::string& key);

/// A program that prints its address because it uses port 0. It exits after two minutes if the test is killed.
class Service {
 public:
  /// The address is `key` of the JSON event `event`.
  Service(const std::string& name, std::vector<std::string> arguments, const std::filesystem::path& folder,
          const std::string& event, const std::string& key, std::vector<std::string> more_environment = {});

  const std::string& address() const noexcept { return address_; }
  Process& process() noexcept { return process_; }

  /// Returns the last line of stdout. Throws std::runtime_error if the exit code is different.
  std::string stop(int signal = SIGTERM, int exit_code = 0);

 private:
  Process process_;
  std::string address_;
};

class Server : public Service {
 public:
  Server(const std::filesystem::path& folder, const std::filesystem::path& scene, std::vector<std::string> more = {},
         std::vector<std::string> more_environment = {});
};

/// A client program, "virtual_wall" or "echo_motion". It is stopped after two minutes if the test is killed.
class Client : public Process {
 public:
  Client(const std::string& name, const std::string& server, const std::filesystem::path& folder,
         std::vector<std::string> more = {});
};

/// Reads the force along x (N) from echo_motion until `enough` returns true. Fails after kPatience.
template <class Enough>
void watch_force(Process& echo, Enough enough) {
  while (!enough(number_in(echo.wait_for_line(R"("force_n")"), "force_n"))) {
  }
}

struct Recording {
  std::vector<StepRecord> steps;
  std::vector<DatagramRecord> arrived;
  std::uint64_t losses = 0;  ///< records of losses, excluding intended omissions
  std::uint64_t unauthenticated_left_out = 0;
  bool truncated = false;
};
Recording read_recording(const std::filesystem::path& file);

/// Checks a recording for which the limiter was used: steps must be consecutive, no force may exceed the bound, and the
/// ledger must be above −1 nJ. After an overrun, it must not decrease until the next one, and forces must not exceed
/// the limiter's Coulomb friction.
void expect_passive(const Recording& recording, const Scene& scene);

}  // namespace tendon::e2e
