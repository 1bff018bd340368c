// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/scene.h"
#include "clients/softbody/surface/shells.h"

namespace tendon::softbody {

std::string scene_reference() {
  std::ostringstream text;
  text << "effects = [...]          list of the simulated effects; all others are off:\n";
  for (const auto& each : effects()) text << "    " << each.name << ": " << each.what << '\n';
  text
      << "gravity_m_per_s2 = [0, 0, -9.81]     gravity in the body's frame; with the effect gravity\n"
         "damping_per_s            rate at which motion is damped; with the effect damping\n"
         "viscosity_ms             time constant of the viscous stress; with the effect viscosity\n"
         "friction                 coefficient of friction of the tool; with the effect friction\n"
         "step_ms                  time step of each answer; with inertia, damping or viscosity\n"
         "[[cutting]]              one table for each cut, in the order of the cuts; they follow the faces of "
         "elements\n"
         "corner_mm, along_mm, deep_mm     parallelogram: a corner and two sides, in the body's frame at rest\n"
         "at_s                     time of the cut after the first answer; or\n"
         "above_n                  force along the normal above which the cut is made after the answer\n"
         "[stiffening]             change of Young's modulus over time, relative to that of the material\n"
         "at_s, factor             [times after the first answer], [factors]; interpolated linearly\n"
         "[plasticity]             plastic deformation\n"
         "yield_pa, hardening_pa   yield stress of a bar, and its hardening modulus H; after yielding, the modulus of\n"
         "                         the bar is E H/(E + H)\n"
         "[self-collision]         for corotational, neo-hookean\n"
         "layer_mm                 penetration of two sides at which their pressure is Young's modulus\n"
         "[body]\n"
         "shape                    block, cylinder or file\n"
         "element                  type of the elements:\n";
  for (const auto& each : elements()) text << "    " << each.name << ": " << each.what << '\n';
  text << "size_mm, cells           for a block: size and number of cells, [x, y, z]\n"
          "radius_mm, height_mm, cells_across, cells_up     for a cylinder\n"
          "file, units_per_m        for a file: a mesh of gmsh, and its units; 1000 if it is in mm\n"
          "slits = false            for a file: true keeps nodes at the same place separate; false merges them\n"
          "clamped_below_mm = 0     height above the lowest node up to which nodes are fixed\n"
          "[body.material]\n"
          "young_pa, poisson        Young's modulus, and Poisson's ratio from 0 to 0.4999\n"
          "density_kg_per_m3        density; with gravity, inertia or damping\n"
          "[[region]]               one table for each part of another material; where two overlap, the later one is\n"
          "                         used\n"
          "middle_mm                centre in the body's frame at rest; the region has the elements whose centre is\n"
          "                         inside\n"
          "radius_mm, or size_mm    radius of a ball, or size of a box, [x, y, z]\n"
          "material                 young_pa, poisson; the density is that of the body\n"
          "[model]\n"
          "kind                     model of the body:\n";
  for (const auto& each : models()) text << "    " << each.name << ": " << each.what << '\n';
  const BodyConfig defaults;
  text
      << "table                    for condensed: file from `tendon-softbody condense SCENE FILE`. Default: the table\n"
         "                         is computed at the start\n"
         "law = \"corotational\"     for near: law of the elements near the tool, one of ";
  std::string_view comma;
  for (const NearLaw& each : near_laws()) text << std::exchange(comma, ", ") << each.name;
  text << ";\n"
          "                         the rest of the body is linear. The last one requires material-nonlinearity\n"
          "max_iterations = "
       << defaults.max_iterations
       << "      iterations of one answer; for corotational, neo-hookean, near, and linear with plasticity\n"
          "error_percent = "
       << 100 * defaults.tolerance
       << "   maximum error of the force, for the same models. The estimated error is part of the answer;\n"
          "                         near adds that of the linear far field\n"
          "learn = false            for near: solve presses within reach_mm of the middle at the start, and\n"
          "                         approximate all others by a few shapes. error_percent = "
       << 100 * NearConfig::kErrorOfLearned
       << " is then\n"
          "                         the default. Where the error is larger, and after a cut, the near field is used\n"
          "tabulate = false         for near: compute a table of the energy from the same presses, which is used "
          "before\n"
          "                         the shapes\n"
          "learned_in               folder in which the learned data are stored for the next start\n"
          "[touch]\n"
          "patch_radius_mm          radius of the patch on which the tool presses\n"
          "from = [0, 0, 1]         direction to the tool, in the body's frame\n"
          "middle_mm = [0, 0, 0]    centre of the touched side; only its place across `from` is used\n"
          "reach_mm                 for condensed: maximum distance of the tool from the centre. Default: no limit. "
          "For\n"
          "                         near with learn or tabulate: range along each axis, at most 1.5 patch radii\n"
          "tool = \"patch\"           or sphere, capsule: rigid, with a contact that grows with the depth; for "
          "condensed\n"
          "                         without friction, corotational, neo-hookean. box, mesh: for the last two\n"
          "tool_radius_mm = 0       radius of the sphere or the capsule, or distance at which a patch touches\n"
          "tool_length_mm           for a capsule: distance between the centres of its ends\n"
          "tool_axis = [0, 0, 1]    for a capsule: direction from end to end, in the handle's frame\n"
          "tool_size_mm, tool_edge_mm     for a box: [x, y, z] along the handle's axes, and the radius of its edges\n"
          "tool_file, tool_units_per_m    for a mesh: closed surface (.stl, .obj, .off) around the tool's centre, "
          "along\n"
          "                         the handle's axes, and its units; 1000 if it is in mm\n"
          "tool_cell_mm             for a mesh: cell size of its distance grid, at most half of its thinnest part\n"
          "layer_mm = 0.1           for rigid tools on corotational, neo-hookean: thickness of the contact layer\n"
          "tool_offset_mm = [0, 0, 0]     position of the tool's centre in the handle's frame. With an offset, a "
          "capsule,\n"
          "                         a box or a mesh, there is a torque on the handle\n"
          "side = \"unilateral\"      or bilateral: after the first touch, the tool sticks to the body and pulls\n"
          "whole_stiffness = false  for linear, condensed, plasticity, at rest: send the complete stiffness of a flat\n"
          "                         surface, as it is always done for curved surfaces and Newton's method\n"
          "table_mm                 for slow networks: answers contain the force at 16 depths within this distance, "
          "for\n"
          "                         the time of 17 answers. For condensed, unilateral, without friction\n"
          "[[hands]]                two or more hands at the body, one table for each; for rigid tools on "
          "corotational,\n"
          "                         neo-hookean\n"
          "device, server           name of the device of this hand, and HOST:PORT of its server if it is another one\n"
          "at_mm                    replaces at_mm of [place], in the frame of this device\n"
          "[place]\n"
          "at_mm = [0, 0, 0]        position of the centre of the touched side, in the frame of the device\n"
          "towards_hand = [0, 0, 1] direction from there to the hand, in the frame of the device\n";
  return text.str();
}

double patch_up_to(const BodyConfig& body) {
  const bool nonlinear = info(body.model).always.has(EffectKind::kGeometricNonlinearity);
  constexpr double kDeepest = 0.3;  // fraction of the radius, close to the limit load
  return nonlinear && std::holds_alternative<PatchTool>(body.tool) ? kDeepest * body.patch_radius
                                                                   : std::numeric_limits<double>::infinity();
}

std::string beyond_the_patch(const BodyConfig& body) {
  std::ostringstream text;
  text << std::setprecision(2) << "pressed deeper than " << 1e3 * patch_up_to(body)
       << " mm, 0.3 of the patch's radius: a patch of fixed size is not realistic at this depth; use tool = "
          "\"sphere\", \"capsule\" or \"box\", which are rigid";
  return text.str();
}

std::string turned_too_far(double linear_up_to) {
  std::ostringstream text;
  text << std::setprecision(2) << "pressed deeper than " << 1e3 * linear_up_to
       << " mm, part of the body turns by more than " << Body::kLargestTurn
       << " rad, so the forces are wrong; use corotational or neo-hookean for large rotations";
  return text.str();
}

std::vector<std::string> warnings(const BodyConfig& body) {
  std::vector<std::string> all;
  const ElementInfo& element = info(body.element);
  double poisson = body.material.poisson;
  for (const Region& region : body.regions) poisson = std::max(poisson, region.material.poisson);
  if (poisson > element.locks_above) {
    std::ostringstream text;
    text << element.name << " locks above a Poisson ratio of " << element.locks_above << " (here " << poisson
         << "): forces are far too large; use hex8-sri or hex27-sri";
    all.push_back(text.str());
  }
  const auto add = [&all](const std::filesystem::path& file, const std::vector<std::string>& notes) {
    for (const std::string& note : notes) all.push_back(file.string() + ": " + note);
  };
  if (const auto* of = std::get_if<FileShape>(&body.shape)) {
    add(of->file, read_gmsh(of->file, of->scale, of->slits).notes);
  }
  if (const auto* tool = std::get_if<MeshTool>(&body.tool)) add(tool->file, notes_on(read_surface(tool->file)));
  return all;
}

void warn(std::ostream& to, std::string_view program, const BodyConfig& body) {
  for (const std::string& warning : warnings(body)) to << program << ": warning: " << warning << '\n';
}

}  // namespace tendon::softbody
