// SPDX-License-Identifier: Apache-2.0
// tendon-fem-worker: a soft body on all MPI ranks. tendon-fem starts it.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "clients/cpp/usage.h"
#include "clients/cpp/worker/worker.h"
#include "clients/softbody/mpi/spread_solver.h"
#include "clients/softbody/placed_body.h"
#include "clients/softbody/scene.h"

using namespace tendon::softbody;

namespace {

/// Some versions of PETSc give wrong results without an error (a DMDA matrix on one rank, 3.18).
void expect_right_answers() {
  BodyConfig block;
  block.shape = BlockShape{Vec3(0.1, 0.1, 0.05), {4, 4, 2}};
  block.element = Element::kHex27;
  block.material = {.young = 1e4, .poisson = 0.45};
  block.patch_radius = 0.02;
  block.reach = 0.005;
  const SurfaceTable ours = condense(block);
  const SurfaceTable theirs = condense(block, [](const Solid& solid) { return on_ranks(solid, Method::kFactor); });
  const double off = (theirs.compliance - ours.compliance).cwiseAbs().maxCoeff() / ours.compliance.maxCoeff();
  if (!(off < 1e-7)) {
    throw std::runtime_error("the results of PETSc for a small block have a relative error of " + std::to_string(off) +
                             ", expected less than 1e-7");
  }
}

struct Arguments {
  std::string scene;
  std::string file;
  Method method = Method::kChosen;
  bool json = false;
};

class ReportingSolver : public Solver {
 public:
  ReportingSolver(const Solid& solid, Method method) : solver_(on_ranks(solid, method)) {}
  Eigen::MatrixXd solve(const Eigen::MatrixXd& loads) const override {
    Eigen::MatrixXd solution = solver_->solve(loads);
    columns_ += loads.cols();
    std::cerr << "\r" << columns_ << " columns solved " << std::flush;
    return solution;
  }

 private:
  std::unique_ptr<Solver> solver_;
  mutable Eigen::Index columns_ = 0;
};

int condense_scene(const Arguments& arguments, const Ranks& ranks) {
  expect_right_answers();
  const Scene scene = read_scene(arguments.scene);
  if (ranks.rank() == 0) warn(std::cerr, "tendon-fem-worker", scene.body);
  const bool tells = ranks.rank() == 0 && isatty(STDERR_FILENO) != 0;
  const Method method = arguments.method;
  const SurfaceTable table = condense(scene.body, [tells, method](const Solid& solid) -> std::unique_ptr<Solver> {
    if (tells) return std::make_unique<ReportingSolver>(solid, method);
    return on_ranks(solid, method);
  });
  if (tells) std::cerr << "\n";
  if (ranks.rank() != 0) return 0;
  write_table(arguments.file, table);
  const nlohmann::ordered_json made = {{"file", arguments.file},
                                       {"ranks", ranks.count()},
                                       {"nodes", table.nodes.size()},
                                       {"bytes", std::filesystem::file_size(arguments.file)},
                                       {"stiffness_n_per_m", table.stiffness},
                                       {"linear_up_to_m", table.linear_up_to}};
  if (arguments.json) {
    std::cout << made.dump() << '\n';
  } else {
    std::cout << arguments.file << ": " << table.nodes.size() << " nodes, " << made["bytes"] << " bytes, "
              << table.stiffness << " N/m at first touch, with " << ranks.count() << " ranks\n";
  }
  return 0;
}

/// kCondensed is replaced by kLinear, because the workers have no table.
Body live_body(BodyConfig config, Method method) {
  if (std::holds_alternative<CondensedConfig>(config.model)) config.model = LinearConfig{};
  return Body(config, [method](const Solid& solid) { return on_ranks(solid, method); });
}

/// Only rank 0 reads the stream, but every rank computes all answers.
int answer(const Arguments& arguments, const Ranks& ranks) {
  expect_right_answers();
  const Scene scene = read_scene(arguments.scene);
  if (ranks.rank() == 0) warn(std::cerr, "tendon-fem-worker", scene.body);
  PlacedBody body(scene, live_body(scene.body, arguments.method));
  std::unique_ptr<tendon::worker::WorkerStream> stream;
  if (ranks.rank() == 0) {
    try {
      stream = std::make_unique<tendon::worker::WorkerStream>();
    } catch (const std::exception& error) {
      std::cerr << "tendon-fem-worker: " << error.what() << '\n';
      end_all_ranks();  // other ranks are waiting
    }
  }
  tendon::worker::Codec codec;
  for (;;) {
    std::vector<std::byte> bytes;
    std::uint64_t sequence = 0;
    if (stream) {
      if (auto record = stream->next()) {
        bytes = std::move(record->body);
        sequence = record->sequence;
      }
    }
    share_out(bytes);
    if (bytes.empty()) return 0;
    const auto hand = codec.read_state({.body = bytes});
    if (!hand) throw std::runtime_error("expected a state from the proxy, received something else");
    const tendon::Touch touch = body.answer(*hand);
    if (stream) stream->send(codec.answer(sequence, *hand, touch));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Simulate a soft body on all MPI ranks. Started by tendon-fem with only SCENE, it answers the proxy that is "
      "specified in\nthe environment.",
      "tendon-fem-worker");
  tendon::usage::dress(app);
  app.set_version_flag("--version", TENDON_VERSION);
  Arguments arguments;
  const auto add_common = [&](CLI::App& to) {
    to.add_option("SCENE", arguments.scene, "Scene file, with the model linear or condensed");
    to.add_option("--way", arguments.method, "Solver for the body")
        ->transform(tendon::usage::one_of(std::map<std::string, Method>{
            {"chosen", Method::kChosen}, {"factor", Method::kFactor}, {"multigrid", Method::kMultigrid}}))
        ->default_str("chosen");
  };
  add_common(app);
  CLI::App* const verb =
      app.add_subcommand("condense", "Create the table of the condensed body of a scene, for [model] table");
  add_common(*verb);
  verb->add_option("FILE", arguments.file, "Output file")->required();
  verb->add_flag("--json", arguments.json, "Print one JSON object on stdout");
  app.footer(
      "\n"
      "Examples:\n"
      "  mpirun -n 64 tendon-fem-worker condense liver.toml liver.table\n"
      "  tendon-fem serve liver.toml --launch \"mpirun -n 64\"\n\n"
      "`chosen` uses a factorization by MUMPS for small bodies, and conjugate gradients with multigrid for large "
      "ones.\n"
      "Set PETSC_OPTIONS for another solver, for example \"-ksp_type cg -pc_type gamg -ksp_rtol 1e-10\".\n"
      "Exit: 0 success; 1 failed; 2 wrong usage.");
  try {
    tendon::usage::parse(app, argc, argv);
    if (arguments.scene.empty()) throw CLI::RequiredError("SCENE");
  } catch (const CLI::ParseError& error) {
    return tendon::usage::exit_code(app, error);
  }
  int none = 1;  // PETSc reads its options from the environment
  try {
    const Ranks ranks(none, argv);
    try {
      return verb->parsed() ? condense_scene(arguments, ranks) : answer(arguments, ranks);
    } catch (const tendon::SceneError& error) {
      if (ranks.rank() == 0) std::cerr << "tendon-fem-worker: " << error.what() << '\n';
      return 2;
    } catch (const std::exception& error) {
      // All ranks fail together, except for errors of rank 0.
      if (ranks.rank() == 0) std::cerr << "tendon-fem-worker: " << error.what() << '\n';
      return 1;
    }
  } catch (const std::exception& error) {
    std::cerr << "tendon-fem-worker: " << error.what() << '\n';
    return 1;
  }
}
