// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/near_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tendon::softbody {
namespace {

/// Radii of the near field, in radii of the patch, and from where on a material is nearly incompressible.
constexpr double kRadius = 1.5;
constexpr double kRadiusIncompressible = 2;
constexpr double kIncompressible = 0.45;
constexpr double kElementsBeyond = 2;

/// How much of a patch's radius the hand goes while one field takes over from another.
constexpr double kBlendOver = 0.25;

/// A new field is made while the patch goes from so far from the old one's middle as this serves, to so many times as far:
/// at least a piece with each answer, and so many evenly over this way. Sixty modes have 29 pieces. The way to twice as
/// far as it serves is for blending.
constexpr double kWaits = 1.7;
constexpr double kPiecesOnTheWay = 30;

/// So many places are pressed in a piece, to see what the modes miss.
constexpr std::size_t kChecksAtOnce = 2;

/// Iterations of Newton's method in a piece; so many pieces press the new field, and the factor is made in one of them.
constexpr int kIterationsAtOnce = 6;
constexpr int kPresses = 4;
constexpr int kFactorAt = 1;

/// By how much more the true error may be than what is seen of it.
constexpr double kFarSafety = 3;
constexpr double kModesSafety = 3;

/// A field has every patch whose place is so many patch's radii at most from its middle.
constexpr double kReach = 0.45;

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
  std::unique_ptr<NearBody> body = nullptr;  ///< null: all of the body is near
  std::unique_ptr<QuasiStaticModel> model = nullptr;
  double serves = 0;  ///< m: farther from the middle a patch wants a new field
  double missed = 0;  ///< share of the force, by too few modes

  bool holds(const Patch& patch) const {
    return body == nullptr || std::ranges::all_of(patch.nodes, [&](int node) { return body->own_node(node) >= 0; });
  }
  /// Its modes were looked at up to twice as far from its middle as it serves.
  bool holds(const Patch& patch, const Vec3& place, double times) const {
    return body == nullptr || ((place - middle).norm() <= times * serves && holds(patch));
  }

  /// With its own numbers of the nodes.
  Patch own(Patch patch) const {
    for (int& node : patch.nodes) node = body->own_node(node);
    return patch;
  }

  Reaction press(const Patch& patch, Given given, double value) {
    if (body == nullptr) return model->press(patch, given, value);
    const Patch here = own(patch);
    Reaction reaction = model->press(here, given, value);
    if (reaction.error > std::abs(reaction.force)) {  // lost on the way from the last shape
      model->set_displacements(VectorXd::Zero(body->size()));
      reaction = model->press(here, given, value);
    }
    const double depth = std::abs(reaction.depth);
    const double far = depth > 0 ? std::abs(body->left_out(model->displacements())) / depth : 0;
    reaction.error += kFarSafety * far + missed * std::abs(reaction.force);
    return reaction;
  }

  std::size_t bytes() const { return model->bytes() + (body ? body->bytes() : 0); }
};

struct NearModel::Making {
  Patch first;  ///< around which it is
  Vec3 middle;
  Patch patch;  ///< where the hand is now
  double depth;
  std::unique_ptr<Field> field = nullptr;
  std::optional<Pieces> work = {};
  int done = 0;  ///< pieces
};

NearModel::NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config)
    : solid_(solid),
      surface_(surface),
      config_(config),
      at_rest_(factor_at_rest(solid)),
      last_(place_of(solid.mesh(), first)) {
  begin(first, 0);
  go_on(first, 0);
}

NearModel::~NearModel() = default;

void NearModel::begin(const Patch& patch, double depth) {
  making_.reset(new Making{.first = patch, .middle = place_of(solid_.mesh(), patch), .patch = patch, .depth = depth});
  making_->work = pieces_of(*making_);
}

void NearModel::go_on(const Patch& patch, double depth) {
  const Vec3 place = place_of(solid_.mesh(), patch);
  const bool waits = field_ && field_->holds(patch, place, kWaits);
  std::unique_ptr<Making> making = std::move(making_);
  making->patch = patch;
  making->depth = depth;
  bool more = true;
  const auto due = [&] {  // pieces
    return kPiecesOnTheWay * ((place - field_->middle).norm() / field_->serves - 1) / (kWaits - 1);
  };
  do {
    more = making->work->next();
    ++making->done;
    ++pieces_;
  } while (more && (!waits || making->done < due()));
  if (more) {
    making_ = std::move(making);
  } else if (making->field->holds(patch, place, 1)) {
    before_ = std::exchange(field_, std::move(making->field));
    ++fields_;
    blended_ = 0;
    blend_over_ = std::min(kBlendOver * surface_.radius(), field_->serves);
    // The old field may have the patch only a part of that way.
    if (before_) blend_over_ = std::min(blend_over_, 2 * before_->serves - (place - before_->middle).norm());
  } else if (!waits) {
    begin(patch, depth);
    go_on(patch, depth);
  }
}

Pieces NearModel::pieces_of(Making& making) {
  const Patch& patch = making.first;
  const double element = element_below(solid_.mesh(), patch);
  const double least = solid_.largest_poisson() > kIncompressible ? kRadiusIncompressible : kRadius;
  const double a = surface_.radius();
  making.field.reset(new Field{
      .middle = making.middle, .radius = std::max(least * a, a + kElementsBeyond * element), .serves = kReach * a / 2});
  Field& field = *making.field;
  const Vec2 across = surface_.across(field.middle);
  {
    std::vector<int> pressed = surface_.nodes_of_patches(across, kReach * a);
    pressed.insert(pressed.end(), patch.nodes.begin(), patch.nodes.end());  // half off the body it may be farther away
    const VectorXd press = solid_.to_free(patch_load(solid_, surface_.normal(), patch));
    Pieces body = NearBody::make(solid_, at_rest_,
                                 {field.middle, field.radius, config_.modes, std::move(pressed), press}, field.body);
    while (body.next()) co_await kPieceDone;
  }
  co_await kPieceDone;
  const Elastic& elastic = field.body ? static_cast<const Elastic&>(*field.body) : solid_;
  field.model = std::make_unique<QuasiStaticModel>(elastic, surface_, config_.newton);
  if (field.body == nullptr) co_return;
  co_await kPieceDone;

  const double held = kReach * a;
  const std::array places{Vec2(0, 0), Vec2(held, 0), Vec2(-held, 0), Vec2(0, held), Vec2(0, -held)};
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i % kChecksAtOnce == 1) co_await kPieceDone;
    const auto there = surface_.patch(across + places[i]);
    if (!there || !field.holds(*there)) continue;
    const VectorXd load = solid_.to_free(patch_load(solid_, surface_.normal(), *there));
    const double depth = kFirstTouch * a;
    const double whole = depth / load.dot(VectorXd(at_rest_.solve(load)));
    const double near = field.model->press(field.own(*there), Given::kDepth, depth).force;
    field.missed = std::max(field.missed, kModesSafety * std::abs(near / whole - 1));
  }

  if (making.depth <= 0) co_return;
  co_await kPieceDone;
  // Pressed once more, by the factor of that shape: it serves the answers around it better than that of the rest.
  field.model->set_max_iterations(std::min(kIterationsAtOnce, config_.newton.max_iterations));
  for (int i = 0; i < kPresses; ++i) {
    Patch here = field.own(field.holds(making.patch) ? making.patch : patch);
    here.curvatures = {};
    if (i == kFactorAt) field.model->set_displacements(field.model->displacements());
    const Reaction reaction = field.model->press(here, Given::kDepth, making.depth);
    co_await kPieceDone;
    if (i >= kFactorAt && reaction.error <= config_.newton.tolerance * std::abs(reaction.force)) break;
  }
  field.model->set_max_iterations(config_.newton.max_iterations);
}

Reaction NearModel::press(const Patch& patch, Given given, double value) {
  if (patch.nodes.empty()) return {};
  const Vec3 place = place_of(solid_.mesh(), patch);
  const double depth = given == Given::kForce ? last_depth_ : value;
  blended_ += std::hypot((place - last_).norm(), depth - last_depth_);
  last_ = place;
  last_depth_ = depth;
  // Where the hand has gone elsewhere meanwhile.
  if (making_ && (making_->middle - place).norm() > field_->serves) making_.reset();
  if (!making_ && !field_->holds(patch, place, 1)) begin(patch, depth);
  if (making_) go_on(patch, depth);
  if (before_ && (blended_ >= blend_over_ || !before_->holds(patch, place, 2))) before_.reset();
  const Reaction reaction = field_->press(patch, given, value);
  return before_ ? blended(before_->press(patch, given, value), reaction, blended_ / blend_over_) : reaction;
}

NearModel::Size NearModel::size() const {
  if (field_->body == nullptr) {
    return {.elements = static_cast<std::size_t>(solid_.mesh().element_count()),
            .unknowns = solid_.free_count(),
            .made = fields_,
            .pieces = pieces_};
  }
  const NearBody& body = *field_->body;
  return {.radius = field_->radius,
          .elements = static_cast<std::size_t>(body.mesh().element_count()),
          .interface = body.interface(),
          .modes = body.modes(),
          .unknowns = body.free_count(),
          .made = fields_,
          .pieces = pieces_};
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
  // The surface at rest adds the same to both. `giving` stays 0, and `curving` has both.
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
