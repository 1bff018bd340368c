// SPDX-License-Identifier: Apache-2.0
#include "core/field/renderer.h"

#include <algorithm>

#include "core/base/expect.h"

namespace tendon::field {
namespace {

/// Returns the position at the distance `to` from x in the direction of p, which is at the distance `from`.
Vec3 at_distance(const Vec3& p, const Vec3& x, double from, double to) noexcept {
  return from > 0 ? Vec3(x + (p - x) * (to / from)) : x;
}

}  // namespace

Renderer::Renderer(const Config& config) : config_(config), gate_(config.push) {
  expect_above_zero(config.max_stiffness, "max_stiffness");
  expect_not_negative(config.push.push_j, "push_j");
  expect_not_negative(config.push.push_w, "push_w");
}

void Renderer::use(const Field* field, LocalTime now) noexcept {
  field_ = field;
  swapped_ = now;
  swapping_ = true;
  first_tick_.reset();
  if (field == nullptr) {
    started_ = false;
    pose_ = {};
    material_count_ = 0;
    residual_.forget();
    return;
  }
  const std::size_t count = std::min(field->materials.size(), materials_.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (i < material_count_ && described_[i] == field->materials[i]) continue;  // keeps what was learned
    materials_[i] = described_[i] = field->materials[i];
  }
  material_count_ = count;
  from_ = law_;
  blend_ = started_ ? kBlend : 0;
}

double Renderer::stored(const Vec3& x) const noexcept {
  if (!started_) return 0;
  double sum = law_.energy((place_ - x).norm(), dent_);
  for (std::size_t i = 0; i < pull_count_; ++i) sum += pulls_[i].law.energy((pulls_[i].place - x).norm());
  return sum;
}

bool Renderer::observe(std::uint64_t tick, const Vec3& truth, LocalTime now) noexcept {
  if (!first_tick_ || tick < *first_tick_) return false;
  return residual_.learn(tick, truth, now, config_.max_stiffness, std::span(materials_).first(material_count_),
                         config_.learns);
}

void Renderer::start(const Pose& pose, const Vec3& x) noexcept {
  started_ = true;
  proxy_ = Proxy{.position = pose.to_object(x)};
  proxy_.material = field_->at(proxy_.position).material;
  place_ = x;
  dent_ = 0;
  pull_count_ = 0;
  blend_ = 0;
}

void Renderer::follow_material(double period) noexcept {
  const std::uint8_t index = proxy_.material < material_count_ ? proxy_.material : std::uint8_t{0};
  if (index != blends_to_) {
    from_ = law_;
    blend_ = kBlend;
    blends_to_ = index;
  }
  blend_ = std::max(blend_ - period, 0.0);
  law_ = blend_ > 0 ? blended(from_, materials_[index], 1 - blend_ / kBlend) : materials_[index];
}

void Renderer::ease(const Vec3& x, double before, double period, Proxy& proxy) noexcept {
  const double most = kSwapSpeed * period;
  const double depth = (proxy.position - x).norm();
  if (depth > before + most) {
    proxy.position = at_distance(proxy.position, x, depth, before + most);
    bound_ = true;
    return;
  }
  const Vec3 old = proxy_.position - x;
  if (depth >= before - most || old.dot(proxy_.normal) <= 0) return;
  const Vec3 direction = proxy.touching ? Vec3(proxy.position - x) : old;
  const double length = direction.norm();
  if (!(length > 0)) return;
  proxy.position = x + direction * ((before - most) / length);
  bound_ = true;
}

void Renderer::render_surface(const Pose& pose, const Vec3& x, double before, double period,
                              Rendered& result) noexcept {
  const Vec3 local = pose.to_object(x);
  const double old_depth = (place_ - x).norm();
  dent_ = law_.relaxed(old_depth, dent_, period);
  follow_material(period);
  Proxy proxy = field_->has_surface() ? moved(*field_, proxy_, local, law_.friction) : Proxy{.position = local};
  if (swapping_) ease(local, old_depth, period, proxy);

  double depth = (proxy.position - local).norm();
  const double most = gate_.most(before);
  const double wanted = law_.energy(depth, dent_);
  if (wanted > most) {
    const double least = law_.energy(0, dent_);
    if (least > most) dent_ *= most / least;  // U(0, z) is convex in z
    const double paid = law_.depth_of(most, dent_, depth);
    proxy.position = at_distance(proxy.position, local, depth, paid);
    depth = paid;
    bound_ = true;
  }
  proxy_ = proxy;
  place_ = pose.to_base(proxy_.position);
  const double stored = law_.energy(depth, dent_);
  gate_.settle(before, stored);
  result.refused += wanted - std::min(wanted, stored);
  result.stored += stored;
  result.depth = depth;
  result.proxy = place_;
  if (!(depth > 0)) return;
  const Vec3 direction = (place_ - x) / depth;
  result.force = direction * law_.force(depth, dent_);
  result.stiffness = (law_.slope(depth, dent_) * direction) * direction.transpose();
}

void Renderer::render_fixtures(const Pose& pose, const Vec3& x, double period, Rendered& result) noexcept {
  const Vec3 local = pose.to_object(x);
  const std::size_t count = std::min(field_->fixtures.size(), pulls_.size());
  for (std::size_t i = 0; i < count; ++i) {
    Pull& pull = pulls_[i];
    if (i >= pull_count_) pull.place = x;
    const double old_distance = (pull.place - x).norm();
    const double before = i < pull_count_ ? pull.law.energy(old_distance) : 0;
    pull.law = field_->fixtures[i];
    pull.place = pose.to_base(pull.law.nearest(local));
    double distance = (pull.place - x).norm();
    const double wanted = pull.law.energy(distance);
    double paid = pull.law.distance_of(gate_.most(before), distance);
    if (swapping_ && paid > old_distance + kSwapSpeed * period) paid = old_distance + kSwapSpeed * period;
    if (paid < distance) {
      pull.place = at_distance(pull.place, x, distance, paid);
      distance = paid;
      bound_ = true;
    }
    const double stored = pull.law.energy(distance);
    gate_.settle(before, stored);
    result.refused += std::max(wanted - stored, 0.0);
    result.stored += stored;
    if (!(distance > 0)) continue;
    const Vec3 direction = (pull.place - x) / distance;
    result.force += direction * pull.law.force(distance);
    if (pull.law.stiffness * distance < pull.law.most_force) {
      result.stiffness += (pull.law.stiffness * direction) * direction.transpose();
    }
  }
  pull_count_ = count;
}

Renderer::Rendered Renderer::render(const Motion& hand, double account, std::uint64_t tick) noexcept {
  Rendered result;
  if (field_ == nullptr) return result;
  if (!first_tick_) first_tick_ = tick;
  const Vec3& x = hand.position;
  const double period = started_ ? std::clamp(seconds(hand.at - last_), 0.0, kMostPeriod) : 0;
  last_ = hand.at;
  if (!started_) {
    start(pose_.at(hand.at, 0), x);
    swapped_ = hand.at;
    swapping_ = true;
    law_ = materials_[proxy_.material < material_count_ ? proxy_.material : 0];
    blends_to_ = proxy_.material;
    result.proxy = x;
    result.swapping = true;
    residual_.note({.tick = tick, .at = hand.at, .hand = x});
    return result;
  }
  const double before = law_.energy((place_ - x).norm(), dent_);
  gate_.open(account, stored(x), swapping_ ? kSwapPower : EnergyGate::kNoLimit, period);
  bound_ = false;
  const Pose pose = pose_.at(hand.at, period);
  render_surface(pose, x, before, period, result);
  render_fixtures(pose, x, period, result);
  result.credit = gate_.drawn();
  result.swapping = swapping_;
  if (swapping_ && !bound_ && hand.at - swapped_ >= kSwapTime) swapping_ = false;

  const bool pressed = result.depth > 0;
  residual_.note({.tick = tick,
                  .at = hand.at,
                  .hand = x,
                  .depth = result.depth,
                  .direction = pressed ? Vec3((place_ - x) / result.depth) : Vec3(Vec3::Zero()),
                  .spring = law_.spring(result.depth, dent_),
                  .material = blends_to_});
  if (config_.holds) result.force += residual_.held(hand, result.depth, period);
  return result;
}

}  // namespace tendon::field
