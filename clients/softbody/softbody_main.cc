// SPDX-License-Identifier: Apache-2.0
// tendon-softbody: the reference physics engine.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <exception>
#include <filesystem>
#include <future>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "clients/cpp/engine/self_test.h"
#include "clients/cpp/options.h"
#include "clients/softbody/background.h"
#include "clients/softbody/explain.h"
#include "clients/softbody/placed_body.h"
#include "server/machine/output.h"

using namespace tendon;

namespace {

constexpr double kWay = 0.003;  ///< the self-test stays on the surface

constexpr std::chrono::seconds kBetweenLines{10};

int test(const softbody::Scene& scene, const Options& options) {
  softbody::PlacedBody body(scene);
  SelfTestScript script;
  const Mat3 to_device = softbody::to_device(scene);
  const Vec3 lowest = to_device * softbody::lowest_of_tool(scene.body, to_device.transpose());
  script.start = scene.at + kWay * scene.towards_hand - lowest;
  script.into = -scene.towards_hand;
  script.depth = 2 * kWay;
  script.slide = kWay;
  script.elastic = softbody::is_elastic(scene.body);
  if (options.client.rate_hz > 0) script.rate_hz = options.client.rate_hz;
  // Only the first hand moves.
  std::vector<std::optional<DeviceState>> hands(scene.hands.size());
  const SelfTest result = self_test(
      [&](const DeviceState& hand) {
        if (hands.empty()) return body.answer(hand);
        hands.front() = hand;
        return body.answer(hands).front();
      },
      script,
      [&](const SelfTest::Finding& finding) {  // printed at once, because rigid tools need a minute
        std::cout << (options.json ? finding.json() : finding.text()) << std::flush;
      });
  return result.passed() ? 0 : 1;
}

/// The progress is one line in a terminal, and a line from time to time in a log.
void learn(softbody::BodyConfig& body) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  auto told = std::chrono::steady_clock::now();
  auto& learned = std::get<softbody::NearConfig>(body.model).learned;
  learned = softbody::learn(body, [&](std::string_view what) {
    if (terminal) {
      std::cerr << "\r\033[K" << what << std::flush;
    } else if (const auto now = std::chrono::steady_clock::now(); now - told >= kBetweenLines) {
      told = now;
      std::cerr << "tendon-softbody: " << what << std::endl;
    }
  });
  if (terminal) std::cerr << "\r\033[K";
  for (const std::string& warning : learned->warnings) std::cerr << "tendon-softbody: warning: " << warning << '\n';
}

int condense(int argc, char** argv) {
  Options options{.client = {.name = "tendon-softbody condense"}};
  std::string scene_file;
  std::string table_file;
  CommandLine line(
      "Create the table of the condensed body of a scene. It can be used by any number of servers and starts.",
      options);
  line.add_argument("SCENE", scene_file, "Scene file, with the model condensed");
  line.add_argument("FILE", table_file, "File of the table, which is set in [model] table of a scene");
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
  const softbody::Scene scene = softbody::read_scene(scene_file);
  softbody::warn(std::cerr, "tendon-softbody", scene.body);
  const softbody::SurfaceTable table = softbody::condense(scene.body);
  softbody::write_table(table_file, table);
  const auto bytes = std::filesystem::file_size(table_file);
  if (options.json) {
    const nlohmann::ordered_json made = {{"file", table_file},
                                         {"nodes", table.nodes.size()},
                                         {"bytes", bytes},
                                         {"stiffness_n_per_m", table.stiffness},
                                         {"linear_up_to_m", table.linear_up_to}};
    std::cout << made.dump() << '\n';
  } else {
    std::cout << table_file << ": " << table.nodes.size() << " nodes, " << bytes << " bytes, " << table.stiffness
              << " N/m at first touch\n";
  }
  return 0;
}

void prepare_beside(const softbody::Scene& scene, std::optional<softbody::BackgroundThread>& thread,
                    softbody::PlacedBody& body) {
  const bool cuts = !scene.body.cuts.empty();
  const bool near = std::holds_alternative<softbody::NearConfig>(scene.body.model);
  if (!cuts && !near) return;
  if (softbody::factors_may_work_at_once()) {
    thread.emplace();
    body.prepare_by([&](std::packaged_task<void()> work) { thread->give(std::move(work)); });
    return;
  }
  std::cerr << "tendon-softbody: warning: "
            << (!near   ? "answers are delayed by cuts"
                : !cuts ? "answers are delayed by new near fields"
                        : "answers are delayed by cuts and by new near fields")
            << ", because this OpenBLAS only supports one thread; install libopenblas0-pthread\n";
}

int answer(const softbody::Scene& scene, const Options& options, softbody::PlacedBody& body) {
  const double linear_up_to = body.linear_up_to();
  const double patch_up_to = softbody::patch_up_to(scene.body);
  bool told = false;
  const auto watch_depth = [&] {
    if (told || body.deepest() <= std::min(linear_up_to, patch_up_to)) return;
    told = true;
    std::cerr << "tendon-softbody: warning: "
              << (body.deepest() > linear_up_to ? softbody::turned_too_far(linear_up_to)
                                                : softbody::beyond_the_patch(scene.body))
              << '\n';
  };
  if (!scene.hands.empty()) {
    std::vector<HandAt> hands;
    for (const softbody::Scene::Hand& hand : scene.hands) {
      HandAt& own = hands.emplace_back(HandAt{.device = hand.device});
      if (!hand.server.empty()) own.server = hand.server;
    }
    return run(options, hands, [&](std::span<const std::optional<DeviceState>> states) { return body.answer(states); });
  }
  return run(options, [&](const DeviceState& hand) {
    Touch touch = body.answer(hand);
    watch_depth();
    return touch;
  });
}

int simulate(int argc, char** argv, std::string_view first) {
  const bool explains = first == "explain";
  const bool tests = first == "selftest";
  const int skip = explains || tests ? 1 : 0;
  Options options{.client = {.name = "tendon-softbody", .rate_hz = 500}};
  if (skip == 1) options.client.name += ' ' + std::string(first);
  std::string file;
  CommandLine line(
      explains ? "Print what a scene simulates, and the cost of each part. Does not require a server."
      : tests  ? "Test a scene with scripted motions, and print what would feel wrong. Does not require a server."
               : "Simulate a soft body that can be touched. `tendon-softbody explain SCENE` prints what it "
                 "simulates,\n`tendon-softbody selftest SCENE` tests whether it is passive, and `tendon-softbody "
                 "condense SCENE FILE` creates a table.",
      options);
  bool exact = false;
  if (explains) {
    line.add("--exact", exact, "Also print the difference between the modes of the model near and its exact interface");
  }
  line.add_argument("SCENE", file, "Scene file; its keys:\n" + softbody::scene_reference());
  if (const auto exit_code = line.parse(argc - skip, argv + skip)) return *exit_code;

  softbody::Scene scene = softbody::read_scene(file);
  if (softbody::learns(scene.body)) learn(scene.body);
  if (explains) {
    softbody::Explanation explanation = softbody::explain(
        scene, [] { return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC); });
    if (exact) explanation.off_exact = softbody::off_the_exact_interface(scene.body);
    std::cout << (options.json ? in_json(scene, explanation) : in_words(scene, explanation));
    return 0;
  }
  softbody::warn(std::cerr, "tendon-softbody", scene.body);
  if (tests) return test(scene, options);
  const UnblockedOutput output;
  std::optional<softbody::BackgroundThread> thread;
  softbody::PlacedBody body(scene);
  prepare_beside(scene, thread, body);
  if (std::holds_alternative<softbody::NearConfig>(scene.body.model)) {
    options.client.ways.assign(softbody::kSolverPathNames.begin(), softbody::kSolverPathNames.end());
  }
  if (scene.field) options.field = body.field(*scene.field);
  const int exit_code = answer(scene, options, body);
  const softbody::Answered answered{body.fallbacks(), thread ? body.near_field() : std::nullopt};
  if (options.json) {
    std::cout << in_json(answered);
  } else if (const std::string words = in_words(answered); !words.empty()) {
    std::cerr << "tendon-softbody: " << words;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string_view first = argc > 1 ? argv[1] : "";
    return first == "condense" ? condense(argc - 1, argv + 1) : simulate(argc, argv, first);
  } catch (const SceneError& error) {
    std::cerr << "tendon-softbody: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "tendon-softbody: " << error.what() << '\n';
    return 1;
  }
}
