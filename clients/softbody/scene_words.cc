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
  text << "effects = [...]          what is simulated; nothing else is\n";
  for (const auto& each : effects()) text << "    " << each.name << ": " << each.what << '\n';
  text << "gravity_m_per_s2 = [0, 0, -9.81]     in the body's frame; this and the next only with their effect\n"
          "damping_per_s, viscosity_ms (the stress is that of the strain and so long of its rate), friction (a "
          "coefficient)\n"
          "step_ms                  how long an answer lasts, with inertia, damping or viscosity\n"
          "[[cutting]]              a cut, a table for each, made in their order; it runs along the faces of elements\n"
          "corner_mm, along_mm, deep_mm     a parallelogram: one corner and two sides, in the body's frame at rest\n"
          "at_s                     made so long after the first answer; or in place of it\n"
          "above_n                  made after an answer of more newtons along the normal\n"
          "[stiffening]             Young's modulus, of which the material says how much it is at a factor of 1\n"
          "at_s, factor             [times after the first answer], [factors]; straight in between\n"
          "[plasticity]             with what stress of a bar the material yields, and what each strain adds to it\n"
          "yield_pa, hardening_pa   the bar then gives way with E H/(E + H)\n"
          "[self-collision]         of corotational, neo-hookean\n"
          "layer_mm                 so deep are two sides in each other where they press with Young's modulus\n"
          "[body]\n"
          "shape                    block, cylinder or file\n"
          "element                  how it is cut:\n";
  for (const auto& each : elements()) text << "    " << each.name << ": " << each.what << '\n';
  text << "size_mm, cells           of a block: [x, y, z]\n"
          "radius_mm, height_mm, cells_across, cells_up     of a cylinder\n"
          "file, units_per_m        a mesh of gmsh; 1000 when it is in mm\n"
          "slits = false            of a file: true keeps nodes apart that lie at one place; else they become one\n"
          "clamped_below_mm = 0     nodes up to so far above the lowest are held\n"
          "[body.material]\n"
          "young_pa, poisson        0 to 0.4999\n"
          "density_kg_per_m3        with gravity, inertia or damping\n"
          "[[region]]               a part of another material, a table for each; where two overlap, the later one "
          "counts\n"
          "middle_mm                in the body's frame at rest; it has the elements whose middle lies in it\n"
          "radius_mm, or size_mm    of a ball; of a box, [x, y, z]\n"
          "material                 young_pa, poisson; the density is the body's\n"
          "[model]\n"
          "kind                     how it is computed:\n";
  for (const auto& each : models()) text << "    " << each.name << ": " << each.what << '\n';
  const BodyConfig defaults;
  text << "table                    of condensed: a file of `tendon-softbody condense SCENE FILE`; without it the "
          "table is made "
          "at the start\n";
  text << "law = \"corotational\"     of near: how the elements near the tool respond, one of ";
  std::string_view comma;
  for (const NearLaw& each : near_laws()) text << std::exchange(comma, ", ") << each.name;
  text << ";\n                         elsewhere the body is linear. The last wants the effect material-nonlinearity\n";
  text
      << "max_iterations = " << defaults.max_iterations
      << "      of one answer: corotational, neo-hookean, near, and linear with plasticity\n"
         "error_percent = "
      << 100 * defaults.tolerance
      << "   of the force, of the same: an answer ends when it may be wrong by so much, and says by how much;\n"
         "                         near adds what the linear far field may leave out\n"
         "learn = false            of near: presses within reach_mm of the middle, up and down and to and fro, are "
         "solved\n"
         "                         at the start; few shapes of these answer all between. error_percent = "
      << 100 * NearConfig::kErrorOfLearned
      << " then: where\n"
         "                         they are wrong by more, the near field answers; it does after a cut, too\n"
         "tabulate = false         of near: the same presses make a table of the energy; it answers before the shapes\n"
         "learned_in               a folder: what is learned is kept there, and read at the next start\n"
         "[touch]\n"
         "patch_radius_mm          the tool presses on a patch of this size\n"
         "from = [0, 0, 1]         the way to the tool, in the body's frame\n"
         "middle_mm = [0, 0, 0]    of the side that is touched; its place across `from` counts\n"
         "reach_mm                 for condensed: touched only so far from the middle. Without: anywhere; for near "
         "with\n"
         "                         learn or tabulate: they answer so far along each axis, at most 1.5 patch radii\n"
         "tool = \"patch\"           or sphere, capsule: rigid, its contact grows as it is pressed in; of condensed\n"
         "                         (without friction), corotational, neo-hookean; or box, mesh: of the last two\n"
         "tool_radius_mm = 0       how much earlier a patch touches; the sphere's, the capsule's\n"
         "tool_length_mm           of a capsule: between the centres of its ends\n"
         "tool_axis = [0, 0, 1]    of a capsule: from end to end, in the handle's frame\n"
         "tool_size_mm, tool_edge_mm     of a box: [x, y, z] along the handle's axes, and how round its edges are\n"
         "tool_file, tool_units_per_m    of a mesh: a closed surface (.stl, .obj, .off), along the handle's axes "
         "around "
         "the\n"
         "                         tool's middle; 1000 when it is in mm\n"
         "tool_cell_mm             of a mesh: its distances are kept on a grid of so much; at most half of its "
         "thinnest "
         "part\n"
         "layer_mm = 0.1           of rigid tools on corotational, neo-hookean: the layer that they press, how thick\n"
         "tool_offset_mm = [0, 0, 0]     from the handle to the tool's middle, in the handle's frame. A tool at an "
         "offset,\n"
         "                         a capsule, a box and a mesh, give a torque about the handle\n"
         "side = \"unilateral\"      or bilateral: once it has touched, the tool sticks, and pulls\n"
         "whole_stiffness = false  of linear, condensed, plasticity, at rest: the stiffness of a flat surface is\n"
         "                         whole, too, as that of a curved one and of Newton's method always is\n"
         "table_mm                 answers bring the force at 16 depths over so much, for a slow network: 17 answers'\n"
         "                         time. Of condensed, unilateral, without friction\n"
         "[[hands]]                two or more that hold the body at once, a table for each; of rigid tools on\n"
         "                         corotational, neo-hookean\n"
         "device, server           the name of the hand's device; HOST:PORT of its server, where it is another one\n"
         "at_mm                    in place of that of [place], in the frame of this device\n"
         "[place]\n"
         "at_mm = [0, 0, 0]        where in the device's frame the middle of the touched side is\n"
         "towards_hand = [0, 0, 1] the way from there to the hand, in the device's frame\n";
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
       << " mm, 0.3 of the patch's radius: the body gives way under a patch of fixed size as under no tool; "
          "tool = \"sphere\", \"capsule\" or \"box\" is rigid and can be pressed in far";
  return text.str();
}

std::string turned_too_far(double linear_up_to) {
  std::ostringstream text;
  text << std::setprecision(2) << "pressed deeper than " << 1e3 * linear_up_to
       << " mm, part of the body turns by more than " << Body::kLargestTurn
       << " rad, which makes forces that are not there; corotational and neo-hookean know large rotations";
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
         << "): forces come out far too large; use hex8-sri or hex27-sri";
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
