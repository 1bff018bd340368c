// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/stage/stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <variant>

#include "server/recording/recording_reader.h"

namespace tendon::e2e {
namespace {

constexpr const char* kLongestRun = "120";  // s

std::vector<std::string> operator+(std::vector<std::string> a, std::vector<std::string> b) {
  a.insert(a.end(), std::make_move_iterator(b.begin()), std::make_move_iterator(b.end()));
  return a;
}

std::string_view value_in(std::string_view json, const std::string& key) {
  const std::string name = '"' + key + "\":";
  const auto found = json.find(name);
  if (found == std::string_view::npos) throw std::runtime_error("no " + name + " in " + std::string(json));
  return json.substr(found + name.size());
}

}  // namespace

std::filesystem::path program(const std::string& name) { return std::filesystem::path(TENDON_PROGRAMS) / name; }

std::filesystem::path demo_scene() { return std::filesystem::path(TENDON_SCENES) / "demo.toml"; }

std::string write(const std::filesystem::path& file, std::string_view text) {
  std::ofstream(file) << text;
  return file.string();
}

double number_in(std::string_view json, const std::string& key) {
  std::string_view value = value_in(json, key);
  if (value.starts_with('[')) value.remove_prefix(1);
  double number = 0;
  if (std::from_chars(value.data(), value.data() + value.size(), number).ec != std::errc{}) {
    throw std::runtime_error("no number under " + key + " in " + std::string(json));
  }
  return number;
}

std::uint64_t count_in(std::string_view json, const std::string& key) {
  return static_cast<std::uint64_t>(number_in(json, key));
}

std::string text_in(std::string_view json, const std::string& key) {
  const std::string_view value = value_in(json, key);
  if (!value.starts_with('"')) throw std::runtime_error("no text under " + key + " in " + std::string(json));
  return std::string(value.substr(1, value.find('"', 1) - 1));
}

Service::Service(const std::string& name, std::vector<std::string> arguments, const std::filesystem::path& folder,
                 const std::string& event, const std::string& key, std::vector<std::string> more_environment)
    : process_(program(name),
               std::move(arguments) +
                   std::vector<std::string>{"--listen", "127.0.0.1:0", "--json", "--duration-s", kLongestRun},
               folder, std::move(more_environment)),
      address_(text_in(process_.wait_for_line("\"event\":\"" + event + '"'), key)) {}

std::string Service::stop(int signal, int exit_code) {
  process_.signal(signal);
  const int code = process_.wait();
  std::string said = process_.out();
  if (code != exit_code) throw std::runtime_error("exit code " + std::to_string(code) + ", stderr:\n" + process_.err());
  if (said.ends_with('\n')) said.pop_back();
  return said.substr(said.rfind('\n') + 1);
}

Server::Server(const std::filesystem::path& folder, const std::filesystem::path& scene, std::vector<std::string> more,
               std::vector<std::string> more_environment)
    : Service("tendond", std::vector{scene.string()} + std::move(more), folder, "listening", "address",
              std::move(more_environment)) {}

Client::Client(const std::string& name, const std::string& server, const std::filesystem::path& folder,
               std::vector<std::string> more)
    : Process(program(name),
              std::vector<std::string>{"--server", server, "--duration-s", kLongestRun} + std::move(more), folder) {}

Recording read_recording(const std::filesystem::path& file) {
  Recording recording;
  RecordingReader reader(file);
  while (const auto record = reader.next()) {
    if (const auto* step = std::get_if<StepRecord>(&*record)) recording.steps.push_back(*step);
    if (const auto* loss = std::get_if<LossRecord>(&*record)) {
      recording.unauthenticated_left_out += loss->unauthenticated;
      recording.losses += loss->steps + loss->datagrams > 0 ? 1U : 0U;
    }
    if (const auto* datagram = std::get_if<DatagramRecord>(&*record)) {
      if (datagram->direction == DatagramRecord::Direction::kIn) recording.arrived.push_back(*datagram);
    }
  }
  recording.truncated = reader.truncated();
  return recording;
}

void expect_passive(const Recording& recording, const Scene& scene) {
  const double coulomb = scene.loop.control.limiter.friction.coulomb;
  double energy = 0;
  std::uint64_t tick = 0;
  for (const StepRecord& step : recording.steps) {
    SCOPED_TRACE("tick " + std::to_string(step.tick));
    ASSERT_EQ(step.tick, ++tick);
    ASSERT_LE(step.applied.norm(), step.permitted * (1 + 1e-9));
    if (step.energy < 0) {
      ASSERT_LE(step.applied.norm(), coulomb * (1 + 1e-9));
    }
    if (!step.reasons.has(Reason::kOverrun)) {
      ASSERT_GE(step.energy, std::min(-1e-9, energy - 1e-15));
    }
    energy = step.energy;
  }
}

}  // namespace tendon::e2e
