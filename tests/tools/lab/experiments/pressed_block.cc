// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/pressed_block.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/softbody/fem/mesh.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::lab {
namespace {

using namespace softbody;

constexpr double kGrowth = 1.5;   // ratio of successive cell widths outside the patch
constexpr double kCoarser = 1.5;  // ratio of cell widths for estimating the mesh error
constexpr double kSlide = 0.25;   // patch radii
constexpr int kSamples = 100;     // of the script

/// Distances of cell boundaries: `fine` wide up to `around`, then growing, the last at `length`.
std::vector<double> outward(double length, double around, double fine) {
  std::vector<double> ends;
  double width = fine;
  for (double end = 0; end < length - 1e-9 * fine;) {
    if (end >= around - 1e-9 * fine) width *= kGrowth;
    ends.push_back(end += width);
  }
  for (double& end : ends) end *= length / ends.back();
  return ends;
}

std::vector<double> layers(double low, double high, double middle, double around, double fine) {
  const std::vector<double> down = outward(middle - low, around, fine);
  const std::vector<double> up = outward(high - middle, around, fine);
  std::vector<double> all;
  for (auto end = down.rbegin(); end != down.rend(); ++end) all.push_back(middle - *end);
  all.push_back(middle);
  for (const double end : up) all.push_back(middle + end);
  all.front() = low;
  all.back() = high;
  return all;
}

Solid graded(const PressedBlock& block, softbody::Law law, double cells) {
  // Selective integration is slightly less accurate; used only where locking requires it.
  const Element element =
      block.material.poisson > info(Element::kHex27).locks_above ? Element::kHex27Sri : Element::kHex27;
  const double a = block.patch_radius;
  const double fine = a / cells;
  const Vec2& c = block.patch_centre;
  const Vec3 half = 0.5 * block.size;
  Mesh mesh = softbody::block(Shape::kHex27, layers(-half.x(), half.x(), c.x(), a, fine),
                              layers(-half.y(), half.y(), c.y(), a, fine),
                              layers(0, block.size.z(), block.size.z(), a / 2, fine));
  Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  return {std::move(mesh), element, block.material, law, fixed};
}

Patch patch_of(const TouchSurface& top, const PressedBlock& block) {
  const auto patch = top.patch(top.across(block.touch_point()));
  if (!patch) throw std::invalid_argument("--patch-center-mm: expected at least half of the patch on the block");
  return *patch;
}

double linear_stiffness(const PressedBlock& block, double cells) {
  const Solid solid = graded(block, softbody::Law::kLinear, cells);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), block.patch_radius);
  return LinearModel(solid, top).press(patch_of(top, block), Prescribed::kForce, block.loads[0]).stiffness;
}

}  // namespace

void PressedBlock::check() const {
  const auto expect = [](bool good, const char* what) {
    if (!good) throw std::invalid_argument(what);
  };
  expect(size.allFinite() && size.minCoeff() > 0, "--block-mm: expected three lengths above 0, for example 100x100x50");
  softbody::check(material);
  expect(patch_radius > 0 && std::isfinite(patch_radius), "--patch-radius-mm: expected more than 0");
  expect(patch_centre.allFinite() && 2 * std::abs(patch_centre.x()) < size.x() &&
             2 * std::abs(patch_centre.y()) < size.y(),
         "--patch-center-mm: expected a point on the top, relative to its center");
  expect(loads[0] > 0 && loads[1] > loads[0] && std::isfinite(loads[1]),
         "--loads-n: expected a small force above 0 and a larger one");
}

/// The linear body on the finest mesh, condensed to the region of the tools.
struct Truth::Fine {
  Fine(const PressedBlock& block, double cells)
      : solid(graded(block, softbody::Law::kLinear, cells)),
        top(solid.mesh(), Vec3::UnitZ(), block.patch_radius),
        model(solid, top, top.nodes_of_patches(top.across(block.touch_point()), 1.01 * kSlide * block.patch_radius)),
        contact(model, top, 0, PatchContact::Side::kUnilateral) {}

  Solid solid;
  TouchSurface top;
  CondensedModel model;
  PatchContact contact;
};

Truth::~Truth() = default;

Truth::Truth(const PressedBlock& block, const Config& config) : block_(block), config_(config) {
  block.check();
  if (!(config.cells >= 1.5 && config.cells_for_large >= 1.5)) {
    throw std::invalid_argument("the reference requires 1.5 cells or more per radius of the patch");
  }
  fine_ = std::make_unique<Fine>(block, config.cells);
  linear_ = fine_->model.press(patch_of(fine_->top, block), Prescribed::kForce, block.loads[0]).stiffness;
}

Stiffness Truth::stiffness(std::size_t load) {
  const auto found = limit(softbody::Law::kNeoHookean, load);
  if (!found) throw std::invalid_argument("--loads-n: the block collapses under this force");
  return *found;
}

double Truth::uncertainty() {
  if (!uncertainty_) {
    uncertainty_ = std::abs(linear_stiffness(block_, config_.cells / kCoarser) / linear_ - 1);
    const auto coarse = ratios(softbody::Law::kNeoHookean, block_.material, config_.cells_for_large / kCoarser)[1];
    if (coarse) *uncertainty_ += std::abs(coarse->secant * linear_ / stiffness(1).secant - 1);
  }
  return *uncertainty_;
}

const Truth::Factor& Truth::factor() {
  if (!factor_) {
    // At the depth of each load: the force of the linear body, and the ratio of the load to it.
    std::array<double, 2> linear{};
    std::array<double, 2> excess{};
    for (std::size_t load = 0; load < linear.size(); ++load) {
      linear[load] = linear_ * block_.loads[load] / stiffness(load).secant;
      excess[load] = (block_.loads[load] / linear[load] - 1) / linear[load];
    }
    const double beta = (excess[1] - excess[0]) / (linear[1] - linear[0]);
    factor_ = {.alpha = excess[0] - beta * linear[0], .beta = beta};
  }
  return *factor_;
}

const std::vector<Touched>& Truth::script() {
  if (!script_.empty()) return script_;
  const double depth = block_.loads[0] / stiffness(0).secant;
  for (int i = 0; i < kSamples; ++i) {
    const double phase = 3.0 * (i + 0.5) / kSamples;  // press, slide, release
    const auto ease = [](double x) { return 0.5 - 0.5 * std::cos(std::numbers::pi * std::clamp(x, 0.0, 1.0)); };
    const Vec3 tool = block_.touch_point() + Vec3(ease(phase - 1) * kSlide * block_.patch_radius, 0,
                                                  -depth * (1.2 * (ease(phase) - ease(phase - 2)) - 0.2));
    script_.push_back({tool, force(tool)});
  }
  return script_;
}

Truth::AtLoads Truth::ratios(softbody::Law law, const Material& material, double cells) const {
  PressedBlock block = block_;
  block.material = material;
  const double linear = linear_stiffness(block, cells);
  const Solid solid = graded(block, law, cells);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), block.patch_radius);
  QuasiStaticModel model(solid, top, {});
  AtLoads result;
  for (std::size_t load = 0; load < result.size(); ++load) {
    const Reaction reaction = model.press(patch_of(top, block), Prescribed::kForce, block.loads[load]);
    if (!(reaction.error <= 1e-3 * reaction.force) || solid.inverted(model.displacements()) > 0) break;
    result[load] = Stiffness{reaction.force / reaction.depth / linear, reaction.stiffness / linear};
  }
  return result;
}

std::optional<Stiffness> Truth::limit(softbody::Law law, const Material& material, std::size_t load) {
  const auto [found, is_new] = limits_.try_emplace({law, material.young, material.poisson});
  if (is_new) {
    PressedBlock other = block_;
    other.material = material;
    const bool same = material.young == block_.material.young && material.poisson == block_.material.poisson;
    const double linear = same ? linear_ : linear_stiffness(other, config_.cells);
    found->second = law == softbody::Law::kLinear ? AtLoads{Stiffness{1, 1}, Stiffness{1, 1}}
                                                  : ratios(law, material, config_.cells_for_large);
    for (auto& at : found->second) {
      if (at) at = Stiffness{at->secant * linear, at->tangent * linear};
    }
  }
  return found->second.at(load);
}

Vec3 Truth::force(const Vec3& tool) {
  const Vec3 linear = fine_->contact.at(tool).force;
  const double f = linear.z();
  return (1 + factor().alpha * f + factor().beta * f * f) * linear;
}

}  // namespace tendon::lab
