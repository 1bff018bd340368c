// SPDX-License-Identifier: Apache-2.0
// tendon-precice-worker: a worker whose solver is coupled through preCICE.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "clients/cpp/usage.h"
#include "clients/cpp/worker/worker.h"
#include "clients/precice/precice_engine.h"

namespace {

using tendon::precice_worker::PreciceEngine;

int run(int argc, char** argv) {
  CLI::App app(
      "Run a worker for a solver that is coupled by preCICE. Its participant Hand has a mesh of a round patch on the "
      "surface\nof the body. It writes the displacement of the patch and reads the force that is required for it.",
      "tendon-precice-worker");
  tendon::usage::dress(app);
  app.footer(
      "Example: tendon-fem serve SCENE --worker \"tendon-precice-worker --config precice-config.xml\"\nExit: 0 the "
      "proxy has closed the stream; 1 failed; 2 wrong usage.");
  app.set_version_flag("--version", TENDON_VERSION);
  PreciceEngine::Config config;
  std::string scene;
  std::vector<double> middle_mm = {0, 0, 0};
  std::vector<double> normal = {-1, 0, 0};
  double radius_mm = 1e3 * config.patch.radius;
  app.add_option("SCENE", scene, "Scene file from the proxy; not used, because the solver defines the body");
  app.add_option("--config", config.file, "Configuration file of preCICE")->type_name("FILE")->required();
  app.add_option("--participant", config.participant, "Name of this participant in the configuration")
      ->capture_default_str();
  app.add_option("--mesh", config.mesh, "Name of the mesh of the patch")->capture_default_str();
  app.add_option("--displacement", config.displacement, "Name of the written data, displacements in m")
      ->capture_default_str();
  app.add_option("--force", config.force, "Name of the read data, forces in N")->capture_default_str();
  app.add_option("--middle-mm", middle_mm, "Centre of the patch on the undeformed surface, in the frame of the hand")
      ->expected(3)
      ->capture_default_str();
  app.add_option("--normal", normal, "Normal of the patch, out of the body")->expected(3)->capture_default_str();
  app.add_option("--radius-mm", radius_mm, "Radius of the patch")->capture_default_str();
  app.add_option("--rings", config.patch.rings, "Number of rings of nodes around the centre")->capture_default_str();
  try {
    tendon::usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return tendon::usage::exit_code(app, error);
  }
  config.patch.middle = 1e-3 * tendon::Vec3(middle_mm[0], middle_mm[1], middle_mm[2]);
  config.patch.normal = tendon::Vec3(normal[0], normal[1], normal[2]);
  config.patch.radius = 1e-3 * radius_mm;
  PreciceEngine engine(config);
  tendon::worker::work([&](const tendon::DeviceState& hand) { return engine.answer(hand); });
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tendon-precice-worker: %s\n", error.what());
    return 1;
  }
}
