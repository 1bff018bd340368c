// SPDX-License-Identifier: Apache-2.0
// tendon-mesh: meshes the volume inside a surface for tendon-softbody.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "clients/cpp/usage.h"
#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/mesher/volume.h"
#include "clients/softbody/surface/shells.h"

using namespace tendon::softbody;

namespace {

struct Arguments {
  std::filesystem::path surface;
  std::filesystem::path out;
  VolumeConfig volume;
  std::vector<double> at;
  bool tetrahedra = false;
  bool json = false;
};

std::string text_of(const MeshReport& report, const Arguments& arguments) {
  char text[700];
  std::snprintf(text, sizeof text,
                "%s: %d nodes, %d %s, edges of %.3g to %.3g\n"
                "  volume %.4g, %+.2f %% of the surface's\n"
                "  scaled Jacobian (1 is a cube): worst %.2f at (%.3g, %.3g, %.3g), worst hundredth below %.2f, median "
                "%.2f\n",
                arguments.out.string().c_str(), report.nodes, report.elements,
                arguments.tetrahedra ? "tetrahedra" : "hexahedra", report.shortest_edge, report.longest_edge,
                report.volume, 100 * report.volume_error, report.worst, report.worst_at.x(), report.worst_at.y(),
                report.worst_at.z(), report.worst_percent, report.median);
  std::string all = text;
  for (const std::string& warning : report.warnings) all += "  warning: " + warning + "\n";
  return all;
}

std::string json_of(const MeshReport& report, const Arguments& arguments) {
  const nlohmann::ordered_json made = {{"file", arguments.out.string()},
                                       {"nodes", report.nodes},
                                       {"elements", report.elements},
                                       {"shape", arguments.tetrahedra ? "tet4" : "hex8"},
                                       {"volume", report.volume},
                                       {"volume_error", report.volume_error},
                                       {"scaled_jacobian",
                                        {{"worst", report.worst},
                                         {"worst_at", {report.worst_at.x(), report.worst_at.y(), report.worst_at.z()}},
                                         {"worst_percent", report.worst_percent},
                                         {"median", report.median}}},
                                       {"edge", {{"shortest", report.shortest_edge}, {"longest", report.longest_edge}}},
                                       {"warnings", report.warnings}};
  return made.dump() + "\n";
}

void make(Arguments& arguments) {
  if (std::filesystem::exists(arguments.out)) {
    throw std::runtime_error(arguments.out.string() + ": the file exists and is not overwritten");
  }
  if (!arguments.at.empty()) arguments.volume.touched = Vec3(arguments.at[0], arguments.at[1], arguments.at[2]);
  arguments.volume.hexahedra = !arguments.tetrahedra;
  const auto tell = [tells = isatty(STDERR_FILENO) != 0](const std::string& what) {
    if (tells) std::cerr << "\r\033[K" << what << std::flush;
  };
  const std::string name = arguments.surface.string();
  tell("reading " + name + " …");
  const Triangles surface = read_surface(arguments.surface);
  tell("checking " + std::to_string(surface.facets.size()) + " facets …");
  check(surface, name);
  tell("running gmsh …");
  std::string words;
  Mesh mesh;
  try {
    mesh = volume_of(surface, arguments.volume, words);
  } catch (const std::runtime_error&) {
    tell("");
    std::cerr << words;
    throw;
  }
  tell("");
  const std::string text = to_gmsh(mesh);
  MeshReport report = report_on(parse_gmsh(text, "gmsh's mesh", 1).mesh, surface);
  const std::vector<std::string> notes = notes_on(surface);
  report.warnings.insert(report.warnings.begin(), notes.begin(), notes.end());
  std::ofstream out(arguments.out);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + arguments.out.string());
  std::cout << (arguments.json ? json_of(report, arguments) : text_of(report, arguments));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Create a volume mesh from a surface, for [body] shape = \"file\" of tendon-softbody", "tendon-mesh");
  tendon::usage::dress(app);
  app.set_version_flag("--version", TENDON_VERSION);
  Arguments arguments;
  app.add_option("SURFACE", arguments.surface, "Closed surface: .stl, .obj or .off")->required();
  app.add_option("--out", arguments.out, "Mesh in gmsh's format 2.2")->required()->type_name("FILE.msh");
  app.add_option("--size", arguments.volume.size,
                 "Edge length of the elements where the body is touched, in the unit of the file")
      ->required()
      ->check(CLI::PositiveNumber);
  CLI::Option* const touched = app.add_option("--at", arguments.at, "Position of this region. Default: the whole body")
                                   ->type_name("X,Y,Z")
                                   ->delimiter(',')
                                   ->expected(3);
  CLI::Option* const reach =
      app.add_option("--reach", arguments.volume.reach, "Radius of this region")->check(CLI::PositiveNumber);
  touched->needs(reach);
  reach->needs(touched);
  app.add_option("--coarsest", arguments.volume.coarsest, "Size of the other elements relative to --size")
      ->check(CLI::Range(1.0, 100.0))
      ->capture_default_str()
      ->needs(touched);
  app.add_flag("--tetrahedra", arguments.tetrahedra,
               "Keep the tetrahedra. Otherwise, each of them is split into four hexahedra, which overestimate the "
               "stiffness far less");
  app.add_flag("--json", arguments.json, "Print one JSON object on stdout");
  app.footer(
      "\n"
      "Example: elements of 8 mm in the touched region, 24 mm elsewhere\n"
      "  tendon-mesh liver.stl --size 8 --at 0,0,60 --reach 40 --out liver.msh\n\n"
      "Surfaces that are not closed, intersect or touch themselves, or have facets turned inside out are refused with "
      "the\n"
      "number of a facet. Repairs are reported as warnings. Requires gmsh (package gmsh).\n"
      "Exit: 0 success; 1 failed; 2 wrong usage.");
  try {
    tendon::usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return tendon::usage::exit_code(app, error);
  }
  try {
    make(arguments);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "tendon-mesh: " << error.what() << '\n';
    return 1;
  }
}
