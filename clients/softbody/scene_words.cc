// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/scene.h"
#include "clients/softbody/surface/shells.h"

namespace tendon::softbody {

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
