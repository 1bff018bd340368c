// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/near_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace tendon::softbody {
namespace {

/// Radii of the near field, in radii of the patch, and from where on a material is nearly incompressible.
constexpr double kRadius = 1.5;
constexpr double kRadiusIncompressible = 2;
constexpr double kIncompressible = 0.45;
constexpr double kElementsBeyond = 2;

/// How much of a patch's radius the hand goes while one field takes over from another.
constexpr double kBlendOver = 0.25;

/// By how much more the true error may be than what is seen of it.
constexpr double kFarSafety = 3;
constexpr double kModesSafety = 3;

/// How deep the first touch is, in radii of the patch.
constexpr double kFirstTouch = 1e-4;

Vec3 place_of(const Mesh& mesh, const Patch& patch) {
  Vec3 place = Vec3::Zero();
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    place += patch.weights[i] * mesh.nodes[at(patch.nodes[static_cast<std::size_t>(i)])];
  }
  return place;
}

/// m, along the axes: the largest element that has a node of the patch.
double element_below(const Mesh& mesh, const Patch& patch) {
  double largest = 0;
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto nodes = mesh.element(e);
    if (std::ranges::none_of(nodes, [&](int node) { return std::ranges::binary_search(patch.nodes, node); })) continue;
    Vec3 low = mesh.nodes[at(nodes[0])];
    Vec3 high = low;
    for (const int node : nodes) {
      low = low.cwiseMin(mesh.nodes[at(node)]);
      high = high.cwiseMax(mesh.nodes[at(node)]);
    }
    largest = std::max(largest, (high - low).maxCoeff());
  }
  return largest;
}

Factor factor_at_rest(const Solid& solid) {
  SymmetricMatrix stiffness = solid.pattern();
  solid.stiffness(VectorXd::Zero(solid.size()), Elastic::Curvature::kExact, stiffness);
  Factor factor(stiffness);
  if (!factor.factorize(stiffness)) {
    throw std::runtime_error("the body can still move as a whole: more of its nodes must be fixed");
  }
  return factor;
}

}  // namespace

struct NearModel::Field {
  Vec3 middle;
  double radius;
  double serves;                   ///< m: so far from the middle a patch keeps an element's distance from the far field
  std::unique_ptr<NearBody> body;  ///< null: all of the body is near
  QuasiStaticModel model;
  double missed = 0;  ///< share of the force, by too few modes

  bool holds(const Patch& patch) const {
    return body == nullptr || std::ranges::all_of(patch.nodes, [&](int node) { return body->own_node(node) >= 0; });
  }
  bool comfortably_holds(const Patch& patch, const Vec3& place) const {
    return body == nullptr || ((place - middle).norm() <= serves && holds(patch));
  }

  Reaction press(const Patch& patch, Given given, double value) {
    if (body == nullptr) return model.press(patch, given, value);
    Patch own = patch;
    for (int& node : own.nodes) node = body->own_node(node);
    Reaction reaction = model.press(own, given, value);
    const double depth = std::abs(reaction.depth);
    const double far = depth > 0 ? std::abs(body->left_out(model.displacements())) / depth : 0;
    reaction.error += kFarSafety * far + missed * std::abs(reaction.force);
    return reaction;
  }

  std::size_t bytes() const { return model.bytes() + (body ? body->bytes() : 0); }
};

NearModel::NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config)
    : solid_(solid), surface_(surface), config_(config), at_rest_(factor_at_rest(solid)), field_(field_around(first)) {
  last_ = place_of(solid.mesh(), first);
}

NearModel::~NearModel() = default;

std::unique_ptr<NearModel::Field> NearModel::field_around(const Patch& patch) {
  ++fields_;
  const Vec3 place = place_of(solid_.mesh(), patch);
  const double element = element_below(solid_.mesh(), patch);
  const double least = solid_.material().poisson > kIncompressible ? kRadiusIncompressible : kRadius;
  double radius = std::max(least * surface_.radius(), surface_.radius() + kElementsBeyond * element);
  // Where elements are of several sizes, a node of the patch may still lie on Γ.
  for (;; radius += element) {
    auto field = field_of(patch, place, radius, element);
    if (field->holds(patch)) return field;
  }
}

std::unique_ptr<NearModel::Field> NearModel::field_of(const Patch& patch, const Vec3& place, double radius,
                                                      double element) {
  const auto load_of = [&](const Patch& at) { return solid_.to_free(patch_load(solid_, surface_.normal(), at)); };
  auto body = NearBody::of(solid_, at_rest_, {place, radius, config_.modes, load_of(patch)});
  const Elastic& elastic = body ? static_cast<const Elastic&>(*body) : solid_;
  const double serves = radius - surface_.radius() - element;
  std::unique_ptr<Field> field(new Field{.middle = place,
                                         .radius = radius,
                                         .serves = serves,
                                         .body = std::move(body),
                                         .model = {elastic, surface_, config_.newton}});
  if (field->body == nullptr) return field;
  const Vec2 across = surface_.across(place);
  for (const Vec2& off : {Vec2(0, 0), Vec2(serves, 0), Vec2(-serves, 0), Vec2(0, serves), Vec2(0, -serves)}) {
    const auto there = surface_.patch(across + off);
    if (!there || !field->holds(*there)) continue;
    const VectorXd load = load_of(*there);
    const double depth = kFirstTouch * surface_.radius();
    const double whole = depth / load.dot(VectorXd(at_rest_.solve(load)));
    Patch own = *there;
    for (int& node : own.nodes) node = field->body->own_node(node);
    const double near = field->model.press(own, Given::kDepth, depth).force;
    field->missed = std::max(field->missed, kModesSafety * std::abs(near / whole - 1));
  }
  return field;
}

Reaction NearModel::press(const Patch& patch, Given given, double value) {
  if (patch.nodes.empty()) return {};
  const Vec3 place = place_of(solid_.mesh(), patch);
  const double depth = given == Given::kForce ? last_depth_ : value;
  blended_ += std::hypot((place - last_).norm(), depth - last_depth_);
  last_ = place;
  last_depth_ = depth;
  if (before_ && (blended_ >= blend_over_ || !before_->holds(patch))) before_.reset();
  if (!field_->comfortably_holds(patch, place)) {
    before_ = std::move(field_);
    field_ = field_around(patch);
    if (!before_->holds(patch)) before_.reset();
    blended_ = 0;
    blend_over_ = kBlendOver * surface_.radius();
  }
  const Reaction reaction = field_->press(patch, given, value);
  return before_ ? blended(before_->press(patch, given, value), reaction, blended_ / blend_over_) : reaction;
}

NearModel::Size NearModel::size() const {
  if (field_->body == nullptr) {
    return {.elements = static_cast<std::size_t>(solid_.mesh().element_count()), .unknowns = solid_.free_count()};
  }
  const NearBody& body = *field_->body;
  return {.radius = field_->radius,
          .elements = static_cast<std::size_t>(body.mesh().element_count()),
          .interface = body.interface(),
          .modes = body.modes(),
          .unknowns = body.free_count()};
}

std::size_t NearModel::bytes() const noexcept {
  return at_rest_.bytes() + field_->bytes() + (before_ ? before_->bytes() : 0);
}

Reaction blended(const Reaction& from, const Reaction& to, double share) {
  const auto mix = [&](const auto& a, const auto& b) { return ((1 - share) * a + share * b); };
  Reaction all;
  all.force = mix(from.force, to.force);
  all.depth = mix(from.depth, to.depth);
  all.stiffness = mix(from.stiffness, to.stiffness);
  all.error = mix(from.error, to.error) + std::abs(from.force - to.force);
  if (!(std::abs(all.force) > 0)) return all;
  all.slope = mix(Vec2(from.force * from.slope), Vec2(to.force * to.slope)) / all.force;
  all.knows_glide = from.knows_glide && to.knows_glide;
  if (!all.knows_glide) return all;
  // PatchContact's K in parts: k along the normal, k s + F t beside it, and across k s sᵀ + F (s tᵀ + t sᵀ − M − F D).
  // What the surface at rest adds is the same of both. `giving` stays 0, and `curving` has both.
  const auto beside = [](const Reaction& r) { return Vec2(r.stiffness * r.slope + r.force * r.glide.tilting); };
  const auto across = [](const Reaction& r) {
    const Mat2 turned = r.slope * r.glide.tilting.transpose();
    return Mat2(r.stiffness * r.slope * r.slope.transpose() +
                r.force * (turned + turned.transpose() - r.glide.curving - r.force * r.glide.giving));
  };
  all.glide.tilting = (mix(beside(from), beside(to)) - all.stiffness * all.slope) / all.force;
  all.glide.curving = (across(all) - mix(across(from), across(to))) / all.force;
  return all;
}

}  // namespace tendon::softbody
