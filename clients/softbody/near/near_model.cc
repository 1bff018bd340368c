// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/near_model.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <future>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/exchange/latest.h"

namespace tendon::softbody {
namespace {

/// The radius of the near field in patch radii. The larger one is for nearly incompressible materials.
constexpr double kRadius = 1.5;
constexpr double kRadiusIncompressible = 2;
constexpr double kIncompressible = 0.45;
constexpr double kElementsBeyond = 2;

constexpr double kFadesOver = 0.25;  ///< motion of the hand, in patch radii, until only the new field is used

/// Without a background thread, a new field is built while the distance of the patch from the center grows from
/// serves_to() to kWaits times this value. 60 modes need 29 pieces. The old field is valid up to twice serves_to().
constexpr double kWaits = 1.7;
constexpr double kPiecesOnTheWay = 30;

constexpr double kRoomLeft = 0.3;  ///< value of `room` at which a field must be complete

constexpr int kIterationsAtOnce = 6;  ///< iterations for each piece
constexpr int kPresses = 4;           ///< pieces that press the new field
constexpr int kFactorAt = 1;          ///< the piece that computes the factor

/// Safety factors of the estimated errors.
constexpr double kFarSafety = 3;
constexpr double kModesSafety = 3;

constexpr double kReach = 0.45;  ///< maximum distance between a patch and the center of its field, in patch radii

constexpr double kDeeper = 0.1;  ///< a new field is requested if the depth has changed by this, in patch radii

/// The accepted relative error of the shape of the whole body (it is not used above ten times this), and the solves.
constexpr double kShape = 1e-3;
constexpr int kShapePresses = 6;

constexpr double kLeftBehind = 3;  ///< if the distance is larger, the field is abandoned

constexpr double kAnswersInMean = 16;  ///< number of answers in the mean motion of the hand

/// The distance (m) from the center at which a new field is needed.
double serves_to(const TouchSurface& surface) { return kReach * surface.radius() / 2; }

/// Returns the size (m) of the largest element below the patch.
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

Factor factor_at_rest(const Solid& solid) { return factor_of(solid.exact_stiffness(VectorXd::Zero(solid.size()))); }

}  // namespace

struct NearModel::Field {
  Vec3 middle = Vec3::Zero();
  double radius = 0;
  double depth = 0;                                   ///< m, of the tool
  double serves = 0;                                  ///< m
  std::unique_ptr<NearBody> body = nullptr;           ///< null if the whole body is near
  std::unique_ptr<QuasiStaticModel> model = nullptr;  ///< null if it was abandoned
  double missed = 0;                                  ///< relative error of the force due to the modes and u*
  Handover handover = {};
  std::exception_ptr failed = nullptr;
  std::unique_ptr<Field> behind = nullptr;

  bool holds(const Patch& patch) const {
    return body == nullptr || std::ranges::all_of(patch.nodes, [&](int node) { return body->own_node(node) >= 0; });
  }
  /// The error of the modes was checked up to twice `serves`.
  bool holds(const Patch& patch, const Vec3& place, double times) const {
    return body == nullptr || ((place - middle).norm() <= times * serves && holds(patch));
  }
  double away(const Vec3& place, double deep) const { return std::hypot((place - middle).norm(), deep - depth); }

  Patch own(Patch patch) const {
    for (int& node : patch.nodes) node = body->own_node(node);
    return patch;
  }

  Reaction press(const Patch& patch, Prescribed given, double value) {
    if (body == nullptr) {
      Reaction reaction = model->press(patch, given, value);
      reaction.way = SolverPath::kWhole;
      return reaction;
    }
    const Patch here = own(patch);
    Reaction reaction = model->press(here, given, value);
    if (reaction.error > std::abs(reaction.force)) {  // the solution is lost
      model->set_displacements(body->beginning());
      reaction = model->press(here, given, value);
    }
    const double far = body->left_out(model->displacements(), std::abs(reaction.depth));
    reaction.error += kFarSafety * std::abs(far) + missed * std::abs(reaction.force);
    reaction.way = SolverPath::kNear;
    return reaction;
  }

  std::size_t bytes() const {
    return (model ? model->bytes() : 0) + (body ? body->bytes() : 0) + (behind ? behind->bytes() : 0);
  }
};

struct NearModel::Making {
  const Solid& solid;
  const TouchSurface& surface;
  const Factor& factor;  ///< at the shape `about`
  const Config& config;
  Patch first;
  double depth;
  Hand hand;
  VectorXd about = {};  ///< all nodes; empty: at rest
  double unsure = 0;    ///< relative error of the force due to `about`
  std::unique_ptr<Field> field = nullptr;
  std::optional<Pieces> work = {};
  int done = 0;
  Vec3 middle = place_of(solid.mesh(), first);

  Pieces pieces();

 private:
  void look_at_modes(const Vec2& across);
};

/// The state of the background thread. The first three members are shared.
struct NearModel::Oracle {
  Oracle(const Solid& of, const TouchSurface& touched, const Config& with)
      : solid(of),
        surface(touched),
        config(with),
        whole(solid, surface, {.max_iterations = kIterationsAtOnce, .tolerance = kShape, .glides = false}),
        bytes(solid.bytes() + whole.bytes()) {}
  ~Oracle() { delete made.load(); }
  Oracle(const Oracle&) = delete;
  Oracle& operator=(const Oracle&) = delete;

  Latest<Hand> hand;
  std::atomic<Field*> made{nullptr};  ///< for the other thread
  std::atomic<bool> left{false};      ///< the other thread does not need it

  const Solid solid;
  const TouchSurface surface;
  const Config config;
  QuasiStaticModel whole;
  bool at_rest = true;  ///< `whole` is at rest
  const std::size_t bytes;

  std::unique_ptr<Field> make(const Vec3& ahead, const Hand& newest);

 private:
  Pieces pieces(Making& making);
};

NearModel::NearModel(const Solid& solid, const TouchSurface& surface, const Patch& first, const Config& config)
    : solid_(solid), surface_(surface), config_(config), at_rest_(factor_at_rest(solid)) {
  last_.place = place_of(solid.mesh(), first);
  begin(first, 0);
  go_on(first, last_.place, 0, 0);
}

NearModel::NearModel(const Solid& solid, const TouchSurface& surface, const Config& config, Background background)
    : solid_(solid), surface_(surface), config_(config), at_rest_(factor_at_rest(solid)), by_linear_(true) {
  make_fields_by(std::move(background));
}

NearModel::~NearModel() { make_no_more_fields(); }

void NearModel::make_fields_by(Background background) {
  make_no_more_fields();
  making_.reset();
  asked_ = false;
  background_ = std::move(background);
  oracle_ = std::make_shared<Oracle>(solid_, surface_, config_);
}

void NearModel::make_no_more_fields() {
  if (oracle_) oracle_->left = true;
  background_ = nullptr;
}

void NearModel::begin_cut() {
  making_.reset();
  field_.reset();
  last_.patch = {};
  by_linear_ = true;
  parted_ = true;
}

void NearModel::cut(const Division&, const EffectsConfig&) {
  begin_cut();
  handover_ = {};
  at_rest_ = factor_at_rest(solid_);
  if (background_) make_fields_by(std::move(background_));
}

void NearModel::go_on_from(const Model& before, std::span<const int>) {
  const auto& same = static_cast<const NearModel&>(before);  // same kind by contract
  handover_ = same.beyond_linear();
  last_ = same.last_;
  begin_cut();
  size_ = same.size_;
  last_took_ = same.last_took_;
  per_answer_ = same.per_answer_;
}

void NearModel::begin(const Patch& patch, double depth) {
  making_.reset(new Making{.solid = solid_,
                           .surface = surface_,
                           .factor = at_rest_,
                           .config = config_,
                           .first = patch,
                           .depth = depth,
                           .hand = last_});
  making_->work = making_->pieces();
}

void NearModel::go_on(const Patch& patch, const Vec3& place, double depth, double room) {
  const bool waits = field_ && field_->holds(patch, place, kWaits);
  const bool needed = !waits && !(room > 0);
  std::unique_ptr<Making> making = std::move(making_);
  making->hand = last_;
  making->depth = depth;
  bool more = true;
  const auto due = [&] {
    if (!waits) return kPiecesOnTheWay * (1 - room) / (1 - kRoomLeft);
    return kPiecesOnTheWay * ((place - field_->middle).norm() / field_->serves - 1) / (kWaits - 1);
  };
  do {
    more = making->work->next();
    ++making->done;
    ++size_.pieces;
  } while (more && (needed || making->done < due()));
  if (more) {
    making_ = std::move(making);
  } else if (making->field->holds(patch, place, 1)) {
    take_over(std::move(making->field));
  } else if (needed) {
    begin(patch, depth);
    go_on(patch, place, depth, room);
  }
}

void NearModel::take_over(std::unique_ptr<Field> field) {
  ++size_.made;
  handover_ = field->handover;
  fading_over_ = std::min(kFadesOver * surface_.radius(), field->serves);
  faded_ = 0;
  by_linear_ = false;
  std::swap(field_, field);
  if (!oracle_ || !field) return;
  field->behind = std::move(spent_);
  spent_ = std::move(field);
}

Pieces NearModel::Making::pieces() {
  const double element = element_below(solid.mesh(), first);
  const double least = solid.largest_poisson() > kIncompressible ? kRadiusIncompressible : kRadius;
  const double a = surface.radius();
  field.reset(new Field{.middle = middle,
                        .radius = std::max(least * a, a + kElementsBeyond * element),
                        .depth = depth,
                        .serves = serves_to(surface),
                        .missed = unsure});
  const Vec2 across = surface.across(middle);
  {
    std::vector<int> pressed = surface.nodes_of_patches(across, kReach * a);
    // may be farther away if the patch is half off the body
    pressed.insert(pressed.end(), first.nodes.begin(), first.nodes.end());
    Pieces body = NearBody::make(solid, factor,
                                 {.middle = middle,
                                  .radius = field->radius,
                                  .modes = config.modes,
                                  .pressed = std::move(pressed),
                                  .press = solid.to_free(patch_load(solid, surface.normal(), first)),
                                  .about = about,
                                  .about_depth = about.size() > 0 ? depth : 0},
                                 field->body);
    while (body.next()) co_await kPieceDone;
  }
  co_await kPieceDone;
  const Elastic& elastic = field->body ? static_cast<const Elastic&>(*field->body) : solid;
  field->model = std::make_unique<QuasiStaticModel>(elastic, surface, config.newton);
  if (field->body == nullptr) co_return;
  co_await kPieceDone;
  look_at_modes(across);

  if (depth <= 0) co_return;
  co_await kPieceDone;
  // The factor of the present shape is better for the next answers than the factor at rest.
  field->model->set_max_iterations(std::min(kIterationsAtOnce, config.newton.max_iterations));
  for (int i = 0; i < kPresses; ++i) {
    const bool held = !hand.patch.nodes.empty() && hand.felt.depth > 0 && field->holds(hand.patch, hand.place, 2);
    const double deep = held ? hand.felt.depth : depth;
    if (i == kFactorAt && about.size() == 0) field->model->set_displacements(field->model->displacements());
    Patch here = field->own(held ? hand.patch : first);
    here.curvatures = {};
    const Reaction reaction = field->model->press(here, Prescribed::kDepth, deep);
    field->handover = held ? handover(hand.felt, reaction, deep) : Handover{};
    co_await kPieceDone;
    if (i >= kFactorAt && reaction.error <= config.newton.tolerance * std::abs(reaction.force)) break;
  }
  field->model->set_max_iterations(config.newton.max_iterations);
}

/// Checks the modes in the center and at the border.
void NearModel::Making::look_at_modes(const Vec2& across) {
  const NearBody& body = *field->body;
  const double held = kReach * surface.radius();
  MatrixXd loads(solid.free_count(), 0);
  MatrixXd own(body.free_count(), 0);
  for (const Vec2& there : {Vec2(0, 0), Vec2(held, 0), Vec2(-held, 0), Vec2(0, held), Vec2(0, -held)}) {
    const auto patch = surface.patch(across + there);
    if (!patch || !field->holds(*patch)) continue;
    const Eigen::Index count = loads.cols() + 1;
    loads.conservativeResize(Eigen::NoChange, count);
    own.conservativeResize(Eigen::NoChange, count);
    loads.rightCols(1) = solid.to_free(patch_load(solid, surface.normal(), *patch));
    own.rightCols(1) = body.to_free(patch_load(body, surface.normal(), field->own(*patch)));
  }
  if (loads.cols() == 0) return;
  const VectorXd whole = factor.solve(loads).cwiseProduct(loads).colwise().sum();
  const VectorXd near = field->model->factor().solve(own).cwiseProduct(own).colwise().sum();
  field->missed += kModesSafety * (whole.cwiseQuotient(near).array() - 1).abs().maxCoeff();
}

Pieces NearModel::Oracle::pieces(Making& making) {
  Reaction pressed;
  bool bent = false;
  for (int i = 0; making.depth > 0 && i < kShapePresses && !bent; ++i) {
    pressed = whole.press(making.first, Prescribed::kDepth, making.depth);
    bent = pressed.error <= kShape * std::abs(pressed.force);
    co_await kPieceDone;
  }
  bent = making.depth > 0 && pressed.error <= 10 * kShape * std::abs(pressed.force) && whole.renew_factor();
  if (bent) {
    making.about = whole.displacements();
    making.unsure = pressed.error / std::abs(pressed.force);
  } else if (!at_rest) {
    whole.set_displacements(VectorXd::Zero(solid.size()));
    whole.renew_factor();
  }
  at_rest = !bent;
  co_await kPieceDone;
  Pieces rest = making.pieces();
  while (rest.next()) co_await kPieceDone;
}

std::unique_ptr<NearModel::Field> NearModel::Oracle::make(const Vec3& ahead, const Hand& newest) {
  const auto patch = surface.patch(surface.across(ahead));
  Making making{.solid = solid,
                .surface = surface,
                .factor = whole.factor(),
                .config = config,
                .first = patch ? *patch : newest.patch,
                .depth = std::max(0.0, newest.felt.depth),
                .hand = newest};
  Pieces work = pieces(making);
  while (work.next()) {
    if (const Hand* const newer = hand.take()) making.hand = *newer;
    const double away = (making.hand.place - making.middle).norm();
    if (left || away > kLeftBehind * serves_to(surface)) return std::make_unique<Field>();
  }
  return std::move(making.field);
}

void NearModel::ask() {
  if (field_ && field_->body == nullptr) return;
  const Vec3 way = last_took_ * per_answer_;
  const double most = kReach * surface_.radius();
  const Vec3 ahead = last_.place + way * std::min(1.0, most / std::max(way.norm(), most * 1e-9));
  const bool serves = field_ && (ahead - field_->middle).norm() <= field_->serves;
  if (serves && std::abs(std::max(0.0, last_.felt.depth) - field_->depth) <= kDeeper * surface_.radius()) return;
  asked_ = true;
  since_asked_ = 0;
  background_(std::packaged_task<void()>(
      [oracle = oracle_, ahead, hand = last_, spent = std::shared_ptr<Field>(std::move(spent_))]() mutable {
        spent.reset();
        std::unique_ptr<Field> made;
        try {
          made = oracle->make(ahead, hand);
        } catch (...) {
          made = std::make_unique<Field>();
          made->failed = std::current_exception();
        }
        oracle->made.store(made.release(), std::memory_order_release);
      }));
}

void NearModel::take_made(const Patch& patch, const Vec3& place, double depth) {
  ++since_asked_;
  std::unique_ptr<Field> made(oracle_->made.exchange(nullptr, std::memory_order_acq_rel));
  if (made == nullptr) return;
  asked_ = false;
  last_took_ = since_asked_;
  if (made->failed) std::rethrow_exception(made->failed);
  const bool nearer =
      !field_ || !field_->holds(patch, place, 2) || made->away(place, depth) < field_->away(place, depth);
  if (made->model != nullptr && made->holds(patch, place, 2) && nearer) return take_over(std::move(made));
  ++size_.late;
  made->behind = std::move(spent_);
  spent_ = std::move(made);
}

Reaction NearModel::press_by_field_or_linear(const Patch& patch, const Vec3& place, Prescribed given, double value) {
  if (field_ && field_->holds(patch, place, 2)) {
    Reaction reaction = field_->press(patch, given, value);
    if (by_linear_) {  // the field is valid again
      handover_ = handover(kept(handover_, 1, linear_press(patch, given, value)), reaction, reaction.depth);
      faded_ = 0;
      by_linear_ = false;
    }
    return kept(handover_, std::max(0.0, 1 - faded_ / fading_over_), reaction);
  }
  ++size_.linear;
  handover_ = beyond_linear();
  by_linear_ = true;
  return kept(handover_, 1, linear_press(patch, given, value));
}

Reaction NearModel::press(const Patch& patch, Prescribed given, double value) {
  if (patch.nodes.empty()) return {};
  const Vec3 place = place_of(solid_.mesh(), patch);
  const double depth = given == Prescribed::kForce ? last_.felt.depth : value;
  faded_ += std::hypot((place - last_.place).norm(), depth - last_.felt.depth);
  make_or_take(patch, place, depth, 0);
  Reaction reaction;
  if (oracle_) {
    reaction = press_by_field_or_linear(patch, place, given, value);
  } else {
    reaction = field_->press(patch, given, value);
    reaction = kept(handover_, std::max(0.0, 1 - faded_ / fading_over_), reaction);
  }
  keep(patch, place, reaction);
  return reaction;
}

void NearModel::follow(const Patch& patch, const Reaction& felt, double room) {
  const Vec3 place = place_of(solid_.mesh(), patch);
  make_or_take(patch, place, felt.depth, room);
  handover_ = {};
  by_linear_ = false;
  keep(patch, place, felt);
}

void NearModel::make_or_take(const Patch& patch, const Vec3& place, double depth, double room) {
  if (oracle_) {
    const Vec3 way = place - last_.place;
    per_answer_ += (way - per_answer_) / kAnswersInMean;
    if (way.norm() > serves_to(surface_)) per_answer_.setZero();
    take_made(patch, place, depth);
    return;
  }
  if (room >= 1) return;
  // The hand has moved away.
  if (making_ && (making_->middle - place).norm() > serves_to(surface_)) making_.reset();
  if (!making_ && !(field_ && field_->holds(patch, place, 1))) begin(patch, depth);
  if (making_) go_on(patch, place, depth, room);
}

void NearModel::keep(const Patch& patch, const Vec3& place, const Reaction& felt) {
  last_.patch.nodes = patch.nodes;
  last_.patch.weights = patch.weights;
  last_.patch.slopes = patch.slopes;
  last_.place = place;
  last_.felt = felt;
  if (background_ && !asked_) ask();
  if (asked_) oracle_->hand.put(last_);
}

NearModel::Size NearModel::size() const {
  Size size = size_;
  size.elsewhere = oracle_ ? oracle_->bytes : 0;
  if (!field_) return size;
  if (field_->body == nullptr) {
    size.elements = static_cast<std::size_t>(solid_.mesh().element_count());
    size.unknowns = solid_.free_count();
    return size;
  }
  const NearBody& body = *field_->body;
  size.radius = field_->radius;
  size.elements = static_cast<std::size_t>(body.mesh().element_count());
  size.interface = body.interface();
  size.modes = body.modes();
  size.unknowns = body.free_count();
  return size;
}

std::size_t NearModel::bytes() const noexcept {
  return at_rest_.bytes() + (field_ ? field_->bytes() : 0) + (spent_ ? spent_->bytes() : 0) +
         (oracle_ ? oracle_->bytes : 0);
}

}  // namespace tendon::softbody
