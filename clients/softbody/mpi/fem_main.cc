// SPDX-License-Identifier: Apache-2.0
// tendon-fem: what a soft body's engine has done by many machines, before anybody touches it.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/softbody/mpi/spread_solver.h"
#include "clients/softbody/scene.h"

using namespace tendon::softbody;

namespace {

/// Does this PETSc solve a body that we can solve by ourselves? Some versions silently do not (a matrix of DMDA on one
/// rank, 3.18).
void expect_right_answers() {
  BodyConfig block;
  block.shape = BlockShape{Vec3(0.1, 0.1, 0.05), {4, 4, 2}};
  block.element = Element::kHex27;
  block.material = {.young = 1e4, .poisson = 0.45};
  block.patch_radius = 0.02;
  block.reach = 0.005;
  const SurfaceTable ours = condense(block);
  const SurfaceTable theirs = condense(block, on_ranks);
  const double off = (theirs.compliance - ours.compliance).cwiseAbs().maxCoeff() / ours.compliance.maxCoeff();
  if (!(off < 1e-7)) {
    throw std::runtime_error("PETSc's answers about a small block are off by " + std::to_string(off) +
                             " of the largest: nothing is made with it");
  }
}

struct Arguments {
  std::string scene;
  std::string file;
  bool json = false;
};

/// On all ranks, and says on a terminal how far it is.
class Told : public Solver {
 public:
  explicit Told(const Solid& solid) : solver_(on_ranks(solid)) {}
  Eigen::MatrixXd solve(const Eigen::MatrixXd& loads) const override {
    Eigen::MatrixXd solution = solver_->solve(loads);
    columns_ += loads.cols();
    std::cerr << "\r" << columns_ << " columns are solved " << std::flush;
    return solution;
  }

 private:
  std::unique_ptr<Solver> solver_;
  mutable Eigen::Index columns_ = 0;
};

int condense_scene(const Arguments& arguments, const Ranks& ranks) {
  expect_right_answers();
  const Scene scene = read_scene(arguments.scene);
  const bool tells = ranks.rank() == 0 && isatty(STDERR_FILENO) != 0;
  const SurfaceTable table = condense(scene.body, [tells](const Solid& solid) -> std::unique_ptr<Solver> {
    if (tells) return std::make_unique<Told>(solid);
    return on_ranks(solid);
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
              << table.stiffness << " N/m at first touch, by " << ranks.count() << " ranks\n";
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Makes the table of a scene's condensed body on as many machines as MPI is started on. tendon-softbody answers "
      "from it "
      "in microseconds, near the device, without MPI.",
      "tendon-fem");
  app.require_subcommand(1);
  Arguments arguments;
  CLI::App* const verb = app.add_subcommand("condense", "The table of a scene's condensed body, for [model] table");
  verb->add_option("SCENE", arguments.scene, "Scene file, with the model condensed")->required();
  verb->add_option("FILE", arguments.file, "The table")->required();
  verb->add_flag("--json", arguments.json, "One JSON object on stdout");
  verb->footer(
      "\nExample:\n  mpirun -n 64 tendon-fem condense liver.toml liver.table\n"
      "\nPETSC_OPTIONS chooses another solver than MUMPS' factor: \"-ksp_type cg -pc_type gamg -ksp_rtol 1e-10\".\n"
      "Exit: 0 done; 1 it failed, with a sentence; 2 wrong usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  }
  int none = 1;  // PETSc's options come by the environment
  try {
    const Ranks ranks(none, argv);
    try {
      return condense_scene(arguments, ranks);
    } catch (const std::exception& error) {
      // All ranks fail alike but for what only rank 0 does: others must not wait for it.
      if (ranks.rank() == 0) std::cerr << "tendon-fem: " << error.what() << '\n';
      return 1;
    }
  } catch (const std::exception& error) {
    std::cerr << "tendon-fem: " << error.what() << '\n';
    return 1;
  }
}
