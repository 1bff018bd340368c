// SPDX-License-Identifier: Apache-2.0
#include "core/control/aol_plus.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/base/expect.h"
#include "core/base/portable_math.h"
#include "core/control/law_support.h"

namespace tendon {

namespace {

// Thrift and damper start at the share kFrom of the bound, and are in full effect kOver above it.
constexpr double kThriftFrom = 0.4;
constexpr double kThriftOver = 0.4;
constexpr double kDamperFrom = 0.3;
constexpr double kDamperOver = 0.4;
constexpr double kStiffEnough = 0.3;   // share of K_s
constexpr double kOldAnswer = 0.01;    // s: age of an answer with full damping
constexpr double kSlowHand = 2e-3;     // m/s: the direction of slower motion is unreliable
constexpr double kMostDamping = 1;     // share of the damped force
constexpr double kDamperMemory = 0.3;  // s, time constant of the debt of the damper
constexpr double kDrivenOver = 0.1;    // s, time constant of P and Q
constexpr double kAgainstDrive = 2.5;  // damping over the negative damping of the object
constexpr double kSmallDamping = 2;    // in f_s: damping without such a drive
constexpr double kLetGoOver = 2;       // M/m − 1 with full damping
constexpr double kCountsAtRest = 1.5;  // one count, whose pulse is higher because the filter is sampled
constexpr double kCountsAhead = 4;     // a growing force must be able to pay for this number of counts
constexpr double kEuler = 2.718281828459045;

template <int Blocks, int Size>
void check(const typename AolPlus<Blocks, Size>::Config& config) {
  expect_above_zero(seconds(config.longest_hold), "longest_hold");
  if (const auto& cap = config.parts.energy_cap) {
    expect(cap->energy >= 0, "energy_cap.energy", cap->energy, "0 J or more");
    expect(cap->most_contact >= 0, "energy_cap.most_contact", cap->most_contact, "0 J or more");
  }
  if (const auto& knee = config.parts.knee) {
    expect(knee->start > 0 && knee->start < 1, "knee.start", knee->start, "a number between 0 and 1");
  }
  if (const auto& reserve = config.parts.latency_reserve) {
    constexpr int kMost = AolPlus<Blocks, Size>::kMostHolds;
    expect(reserve->holds >= 1 && reserve->holds <= kMost, "latency_reserve.holds", reserve->holds,
           "1 to " + std::to_string(kMost));
  }
  if (const auto& bounded = config.parts.bounded_acceleration) {
    for (std::size_t i = 0; i < Blocks; ++i) {
      expect(bounded->most[i] > 0, "bounded_acceleration.most", bounded->most[i], "a number above 0");
    }
    if (!config.parts.shaping) {
      throw std::invalid_argument("bounded_acceleration requires shaping, because nothing else limits the stiffness");
    }
    if (config.parts.latency_reserve) {
      throw std::invalid_argument(
          "bounded_acceleration is not proved for forces that are held late, so it cannot be used with "
          "latency_reserve");
    }
  }
  if (const auto& adaptive = config.parts.adaptive_friction) {
    expect_above_zero(seconds(adaptive->rise), "adaptive_friction.rise");
  }
  if (const auto& shaping = config.parts.shaping) {
    for (const double stiffness : shaping->stiffness) expect_above_zero(stiffness, "shaping.stiffness");
  }
  if (const auto& thrift = config.parts.thrift) {
    expect(thrift->share > 0 && thrift->share <= 1, "thrift.share", thrift->share, "a number above 0, at most 1");
    expect_above_zero(thrift->energy, "thrift.energy");
  }
  if (const auto& damper = config.parts.damper) {
    for (const double viscous : damper->viscous) expect_not_negative(viscous, "damper.viscous");
    for (const double contact : damper->contact) expect_above_zero(contact, "damper.contact");
    expect_above_zero(seconds(damper->smoothing), "damper.smoothing");
    expect_above_zero(seconds(damper->slow), "damper.slow");
    expect_not_negative(damper->dead_zone, "damper.dead_zone");
    for (const double mass : damper->mass) expect_not_negative(mass, "damper.mass");
    expect_above_zero(damper->most_owed, "damper.most_owed");
  }
  if (const auto& fading = config.parts.fading_contact) {
    expect_above_zero(seconds(fading->memory), "fading_contact.memory");
    if (!config.parts.energy_cap) {
      throw std::invalid_argument(
          "fading_contact requires energy_cap, because only energy_cap has a credit for each contact");
    }
  }
}

}  // namespace

template <int Blocks, int Size>
AolPlus<Blocks, Size>::AolPlus(const Config& config)
    : parts_(config.parts),
      shared_(config.shared_account),
      friction_(config.friction),
      longest_hold_(config.longest_hold),
      ledgers_(law_support::each<EnergyLedger, Blocks>([&](std::size_t i) { return config.friction[i]; })),
      target_(config.friction) {
  check<Blocks, Size>(config);
  if (const auto& robust = config.parts.robust_ledger) {
    robust_ = law_support::each<RobustLedger<Size>, Blocks>([&](std::size_t i) {
      return typename RobustLedger<Size>::Config{
          .friction = config.friction[i], .encoder_step = robust->encoder_step[i], .window = robust->window};
    });
  }
  for (std::size_t i = 0; i < bounds_.size(); ++i) use(i, config.friction[i]);
  const Damper damper = config.parts.damper.value_or(Damper{});
  smoothing_ = seconds(damper.smoothing);
  slowness_ = seconds(damper.slow);
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::use(std::size_t block, const Friction& friction) noexcept {
  friction_[block] = friction;
  bounds_[block].coulomb = friction.coulomb;
  bounds_[block].viscous_per_hold = friction.viscous / seconds(longest_hold_);
  ledgers_[block].adapt(friction);
  if (robust_) (*robust_)[block].adapt(friction);
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::hold_at_most(Duration longest_hold) noexcept {
  // This also affects the reserved forces. If T decreases, the reserve is still sufficient.
  const double longer = seconds(longest_hold) / seconds(longest_hold_);
  if (longer > 1) {
    for (double& loss : under_way_) loss *= longer;
  }
  longest_hold_ = longest_hold;
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    bounds_[i].viscous_per_hold = friction_[i].viscous / seconds(longest_hold);
  }
}

template <int Blocks, int Size>
double AolPlus<Blocks, Size>::energy() const noexcept {
  double sum = ledgers_[0].energy();
  for (std::size_t i = 1; i < ledgers_.size(); ++i) sum += ledgers_[i].energy();
  return sum;
}

template <int Blocks, int Size>
double AolPlus<Blocks, Size>::account() const noexcept {
  if (!robust_) return energy();
  double sum = (*robust_)[0].spendable();
  for (std::size_t i = 1; i < robust_->size(); ++i) sum += (*robust_)[i].spendable();
  return sum;
}

template <int Blocks, int Size>
double AolPlus<Blocks, Size>::spendable() const noexcept {
  return account() - discarded_;
}

template <int Blocks, int Size>
double AolPlus<Blocks, Size>::reserved() const noexcept {
  double sum = 0;
  if (parts_.latency_reserve) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(parts_.latency_reserve->holds); ++i) sum += under_way_[i];
  }
  return sum;
}

/// Returns Δ over all coordinates of a group, or 0 if there is no robust ledger.
template <int Blocks, int Size>
double AolPlus<Blocks, Size>::count(std::size_t block) const noexcept {
  return parts_.robust_ledger ? parts_.robust_ledger->encoder_step[block] * std::sqrt(Size) : 0.0;
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::forget_velocity() noexcept {
  velocity_.reset();
  acceleration_holds_ = false;
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::watch_acceleration(const Interval<kSize>& interval) noexcept {
  const double held = seconds(interval.held);
  if (held <= 0) {
    forget_velocity();
    return;
  }
  acceleration_holds_ = false;
  const Vec<kSize> velocity = interval.dx / held;
  if (velocity_) {
    // The difference of the mean velocities of two intervals is at most a times the time between their midpoints, plus
    // the rounding of the three positions.
    acceleration_holds_ = true;
    const double before = seconds(last_held_);
    for (int i = 0; i < Blocks; ++i) {
      const auto block = static_cast<std::size_t>(i);
      const double change = (velocity - *velocity_).template segment<Size>(i * Size).norm();
      const double most = parts_.bounded_acceleration->most[block] * (held + before) / 2;
      // 1e-9: rounding must not flag a hand that is exactly at the limit.
      if (!(change <= most * (1 + 1e-9) + count(block) * (1 / held + 1 / before))) acceleration_holds_ = false;
    }
    if (!acceleration_holds_) ++broken_;
  }
  velocity_ = velocity;
  last_held_ = interval.held;
}

template <int Blocks, int Size>
[[gnu::noinline]] void AolPlus<Blocks, Size>::follow_hand(const Interval<kSize>& interval) noexcept {
  const double held = seconds(interval.held);
  if (held <= 0) return;
  const double fast = std::min(1.0, held / smoothing_);
  const double slow = std::min(1.0, held / slowness_);
  MotionAndForce now;
  now.col(0) = interval.dx / held;
  now.col(1) = interval.applied + damped_;
  for (Eigen::Index k = 0; k < 2 * kSize; ++k) {  // faster than with matrices
    once_smoothed_(k) += fast * (now(k) - once_smoothed_(k));
    smoothed_(k) += fast * (once_smoothed_(k) - smoothed_(k));
    slow_(k) += slow * (smoothed_(k) - slow_(k));
  }
  if (!parts_.damper) return;
  const double recent = std::min(1.0, held / kDrivenOver);
  const MotionAndForce vibration = smoothed_ - slow_;
  for (int i = 0; i < Blocks; ++i) {
    const auto block = static_cast<std::size_t>(i);
    const auto part = vibration.template middleRows<Size>(i * Size);
    driven_[block] += recent * (part.col(0).dot(part.col(1)) - driven_[block]);
    vibrating_[block] += recent * (part.col(0).squaredNorm() - vibrating_[block]);
  }
  // The debt decays. Any income beyond the debt is lost.
  const double forgotten = std::min(1.0, held / kDamperMemory);
  double earned = damped_.dot(interval.dx);
  if (robust_) {
    const Vec<kSize> change = damped_ - damped_before_;
    for (int i = 0; i < Blocks; ++i) {
      earned -= parts_.robust_ledger->encoder_step[static_cast<std::size_t>(i)] / 2 *
                change.template segment<Size>(i * Size).template lpNorm<1>();
    }
  }
  damper_owes_ = std::max(0.0, damper_owes_ - forgotten * damper_owes_ - earned);
  damped_before_ = damped_;
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::observe(const Interval<kSize>& interval) noexcept {
  if (!interval.applied.allFinite() || !interval.dx.allFinite()) {
    forget_velocity();
    return;
  }
  for (int i = 0; i < Blocks; ++i) {
    const auto block = static_cast<std::size_t>(i);
    const Vec<Size> applied = interval.applied.template segment<Size>(i * Size);
    const Vec<Size> dx = interval.dx.template segment<Size>(i * Size);
    ledgers_[block].observe(applied, dx, interval.held);
    if (robust_) (*robust_)[block].observe({.applied = applied, .dx = dx, .held = interval.held});
  }
  if (parts_.energy_cap) {
    contact_ = std::max(0.0, contact_ - interval.applied.dot(interval.dx));
    travel_ += interval.dx;
  }
  if (parts_.bounded_acceleration) watch_acceleration(interval);
  if (parts_.damper || parts_.thrift) follow_hand(interval);
  if (parts_.thrift) held_ = interval.applied.norm();
  if (parts_.adaptive_friction) {
    const double step = std::min(1.0, std::max(0.0, seconds(interval.held) / seconds(parts_.adaptive_friction->rise)));
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      Friction now = friction_[i];
      now.coulomb += (target_[i].coulomb - now.coulomb) * step;
      now.viscous += (target_[i].viscous - now.viscous) * step;
      use(i, now);
    }
  }
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept {
  for (int i = 0; i < Blocks; ++i) {
    const auto block = static_cast<std::size_t>(i);
    const Vec<Size> part = applied.template segment<Size>(i * Size);
    ledgers_[block].observe_unseen(part.norm(), at_most);
    if (robust_) (*robust_)[block].observe_unseen(part, at_most);
  }
  contact_ = 0;
  travel_.setZero();
  once_smoothed_.setZero();
  smoothed_.setZero();
  slow_.setZero();
  driven_ = {};
  vibrating_ = {};
  damped_.setZero();
  damped_before_.setZero();
  held_ = 0;
  forget_velocity();
}

template <int Blocks, int Size>
[[gnu::noinline]] void AolPlus<Blocks, Size>::fade_contact(double most) noexcept {
  contact_ = std::min(contact_, parts_.energy_cap->most_contact);
  if (contact_ <= most) return;
  contact_ += (most - contact_) * std::min(1.0, seconds(longest_hold_) / seconds(parts_.fading_contact->memory));
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::cap(const Vec<kSize>& wanted) noexcept {
  // C_b: the largest energy that a spring with this force and travel returns.
  const auto most = [&] {
    double sum = 0;
    for (int i = 0; i < Blocks; ++i) {
      sum += wanted.template segment<Size>(i * Size).norm() * travel_.template segment<Size>(i * Size).norm();
    }
    return sum;
  };
  const double along = wanted.dot(last_wanted_);
  if (parts_.fading_contact) {
    fade_contact(most());
    if (along < 0) travel_.setZero();
  } else if (along <= 0) {
    contact_ = 0;
    travel_.setZero();
  } else {
    contact_ = std::min(contact_, parts_.energy_cap->most_contact);
    // A branch is faster than std::min, because C is normally below C_b.
    if (const double bound = most(); bound < contact_) [[unlikely]] {
      contact_ = bound;
    }
  }
  last_wanted_ = wanted;
  double kept = parts_.energy_cap->energy + contact_;
  if (shared_) kept += worst_loss(wanted);
  discarded_ = std::max(discarded_, account() - kept);
}

/// Returns ℓ of a group of coordinates if `force` with norm `size` is held.
template <int Blocks, int Size>
[[gnu::noinline]] OutputBound AolPlus<Blocks, Size>::bound_along(std::size_t block, const Vec<Size>& force,
                                                                 double size) const noexcept {
  OutputBound bound = bounds_[block];
  if (!acceleration_holds_ || size == 0) return bound;
  const double hold = seconds(longest_hold_);
  const double towards = velocity_->template segment<Size>(static_cast<int>(block) * Size).dot(force) / size;
  bound.reach = hold * (towards + parts_.bounded_acceleration->most[block] * (seconds(last_held_) + hold) / 2) +
                count(block) * hold / seconds(last_held_);
  return bound;
}

/// Returns ℓ_s of a group of coordinates.
template <int Blocks, int Size>
OutputBound AolPlus<Blocks, Size>::shaping_along(std::size_t block) const noexcept {
  return {.coulomb = friction_[block].coulomb, .viscous_per_hold = parts_.shaping->stiffness[block] / 2};
}

/// The largest share of `force` that the account permits, by ℓ or (`shaping`) by ℓ_s. It can exceed 1.
template <int Blocks, int Size>
double AolPlus<Blocks, Size>::largest_share(const Vec<kSize>& force, double budget, bool shaping) const noexcept {
  std::array<double, Blocks> sizes{};
  std::array<OutputBound, Blocks> bounds;
  for (int i = 0; i < Blocks; ++i) {
    const auto block = static_cast<std::size_t>(i);
    const Vec<Size> part = force.template segment<Size>(i * Size);
    sizes[block] = part.norm();
    bounds[block] = shaping ? shaping_along(block) : bound_along(block, part, sizes[block]);
  }
  return largest_scale(bounds, sizes, budget);
}

/// Returns the factor by which thrift multiplies `force`.
template <int Blocks, int Size>
double AolPlus<Blocks, Size>::give_back(const Vec<kSize>& force, double size, double near,
                                        double budget) const noexcept {
  const Thrift& thrift = *parts_.thrift;
  double ignored = 0;  // v₁
  if (const double step = shared_ && robust_ ? parts_.robust_ledger->encoder_step[0] : 0.0; step > 0) {
    const double counts = slow_.col(0).norm() * slowness_ / step;
    ignored = kCountsAtRest * step / (kEuler * smoothing_ * (1 + counts * counts));
  }
  const double power = force.dot(smoothed_.col(0)) - size * ignored;
  if (power <= 0 || near <= kThriftFrom || budget >= thrift.energy) return 1;
  const double away = std::min(1.0, power / (size * (smoothed_.col(0).norm() + kSlowHand)));
  const double close = std::min(1.0, (near - kThriftFrom) / kThriftOver);
  return 1 - thrift.share * away * close * (1 - std::max(budget, 0.0) / thrift.energy);
}

/// The largest share of a force of norm `size` whose counts the account can pay for.
template <int Blocks, int Size>
double AolPlus<Blocks, Size>::grow(double size, double budget) const noexcept {
  if (!robust_ || parts_.robust_ledger->encoder_step[0] == 0) return 1;
  const double most = held_ + std::max(budget, 0.0) / (kCountsAhead * parts_.robust_ledger->encoder_step[0]);
  return std::min(1.0, std::max(most, friction_[0].coulomb) / size);
}

/// The stiffness of the contact over the one from which a late answer needs the full damper, at most 1.
template <int Blocks, int Size>
double AolPlus<Blocks, Size>::stiff(std::size_t block) const noexcept {
  if (!parts_.energy_cap || !parts_.shaping) return 1;
  const int at = static_cast<int>(block) * Size;
  const double travel = travel_.template segment<Size>(at).norm();
  const double force = last_wanted_.template segment<Size>(at).norm();
  const double enough = kStiffEnough * parts_.shaping->stiffness[block] * travel;
  return force < enough ? force / enough : 1;
}

/// l, for the force F₁ and the motion w of a group of coordinates.
template <int Blocks, int Size>
double AolPlus<Blocks, Size>::let_go(std::size_t block, const Vec<Size>& force, const Vec<Size>& fast) const noexcept {
  const double along = force.dot(fast);
  if (along <= 0 || force.dot(smoothed_.col(0).template segment<Size>(static_cast<int>(block) * Size)) <= 0) return 0;
  const double lighter = parts_.damper->mass[block] * along / (slowness_ * force.squaredNorm());
  return std::clamp((lighter - 1) / kLetGoOver, 0.0, 1.0);
}

/// D for a contact with `force`.
template <int Blocks, int Size>
auto AolPlus<Blocks, Size>::damping(const Vec<kSize>& force, double near, Duration age) const noexcept -> Vec<kSize> {
  Vec<kSize> damping = Vec<kSize>::Zero();
  const Damper& damper = *parts_.damper;
  const double close = (near - kDamperFrom) / kDamperOver;
  const double late = seconds(age) / kOldAnswer;
  const double left = std::max(0.0, 1 - damper_owes_ / damper.most_owed);
  if (left == 0 || std::max(close, late) <= 0) return damping;
  for (int i = 0; i < Blocks; ++i) {
    const auto block = static_cast<std::size_t>(i);
    const Vec<Size> slow = slow_.col(0).template segment<Size>(i * Size);
    const Vec<Size> fast = smoothed_.col(0).template segment<Size>(i * Size) - slow;
    const double speed = fast.norm();
    const double step = robust_ ? parts_.robust_ledger->encoder_step[block] : 0.0;
    double quiet = 0;
    if (step > 0) {
      const double counts = slow.norm() * smoothing_ / step;
      quiet = damper.dead_zone * step / (kEuler * smoothing_ * (1 + counts * counts));
    }
    if (speed <= quiet) continue;
    const double active = left * std::clamp(std::max(close, late * stiff(block)), 0.0, 1.0);
    const double size = force.template segment<Size>(i * Size).norm();
    // Q > 0, because ‖w‖ > 0.
    const double enough =
        std::max({kAgainstDrive * driven_[block] / vibrating_[block], kSmallDamping * damper.contact[block] / speed,
                  let_go(block, force.template segment<Size>(i * Size), fast) * damper.viscous[block]});
    const double viscous = std::min(damper.viscous[block], enough);
    const double wanted = viscous * active * (1 - quiet / speed) * size / (size + damper.contact[block]);
    damping.template segment<Size>(i * Size) = std::min(wanted, kMostDamping * size / speed) * fast;
  }
  return damping;
}

/// Thrift and damper, for a force that the account permits. `near`: wanted over permitted force.
template <int Blocks, int Size>
[[gnu::noinline]] void AolPlus<Blocks, Size>::shape(Duration age, double near, double budget,
                                                    LimitedForce<kSize>& result) noexcept {
  damped_.setZero();
  const double size = result.force.norm();
  if (size == 0) return;
  if (parts_.thrift) {
    const double share = std::min(give_back(result.force, size, near, budget), grow(size, budget));
    if (share < 1) {
      result.force *= share;
      result.reasons |= Reason::kEnergy;
    }
  }
  if (!parts_.damper) return;
  const Vec<kSize> spring = result.force;
  const Vec<kSize> damper = damping(spring, near, age);
  if (damper.isZero(0)) return;
  result.force -= damper;
  result.reasons |= Reason::kDamped;
  const double share = largest_share(result.force, budget);
  if (share < 1) {
    result.force *= share;
    result.reasons |= Reason::kEnergy;
  }
  result.permitted = std::max(result.permitted, result.force.norm());
  damped_ = spring - result.force;
}

template <int Blocks, int Size>
auto AolPlus<Blocks, Size>::limit(const Demand<kSize>& wanted) noexcept -> LimitedForce<kSize> {
  const bool finite = wanted.force.allFinite();
  const Vec<kSize> force = finite ? wanted.force : Vec<kSize>(Vec<kSize>::Zero());
  const double size = force.norm();

  if (parts_.energy_cap) cap(force);
  const double budget = payable();

  double scale = 0;
  double permitted = 0;
  if constexpr (Blocks == 1) {
    permitted = (acceleration_holds_ ? bound_along(0, force, size) : bounds_[0]).largest(budget);
    if (parts_.shaping) permitted = std::min(permitted, shaping_along(0).largest(budget));
    scale = size > 0 ? permitted / size : 1;
  } else {
    scale = largest_share(force, budget);
    if (parts_.shaping) scale = std::min(scale, largest_share(force, budget, true));
    permitted = size > 0 ? scale * size : 0;
  }

  LimitedForce<kSize> result{force, permitted, {}};
  if (!finite) {
    result.reasons = Reason::kNotFinite;
  } else if (parts_.knee) {
    const double start = parts_.knee->start;
    if (size > 0 && scale * start < 1) {
      const double excess = (1 / scale - start) / (1 - start);  // ∞ if nothing is permitted; then tanh is 1
      result.force = force * (scale * (start + (1 - start) * portable::tanh(excess)));
      result.reasons = Reason::kEnergy;
    }
  } else if (size > permitted) {
    result.force = force * (permitted / size);
    result.reasons = Reason::kEnergy;
  }

  if (parts_.thrift || parts_.damper) shape(wanted.age, size > 0 ? 1 / scale : 0.0, budget, result);

  if (parts_.latency_reserve) {
    double loss = 0;
    for (int i = 0; i < Blocks; ++i) {
      loss += bounds_[static_cast<std::size_t>(i)].at(result.force.template segment<Size>(i * Size).norm());
    }
    under_way_[next_under_way_] = loss;
    next_under_way_ = (next_under_way_ + 1) % static_cast<std::size_t>(parts_.latency_reserve->holds);
  }
  return result;
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::credit(double energy) noexcept {
  if (!(energy > 0)) return;
  ledgers_[0].transfer(energy);
  if (robust_) (*robust_)[0].transfer(energy);
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::withdraw(double energy) noexcept {
  if (!(energy > 0)) return;
  ledgers_[0].transfer(-energy);
  if (robust_) (*robust_)[0].transfer(-energy);
}

template <int Blocks, int Size>
double AolPlus<Blocks, Size>::worst_loss(const Vec<kSize>& force) const noexcept {
  const double whole = parts_.knee ? parts_.knee->start : 1.0;
  const double forces = parts_.latency_reserve ? 1.0 + parts_.latency_reserve->holds : 1.0;
  double sum = 0;
  for (int i = 0; i < Blocks; ++i) {
    const auto block = static_cast<std::size_t>(i);
    OutputBound bound = bounds_[block];
    if (parts_.shaping) {
      const double shaping = parts_.shaping->stiffness[block] / 2;
      bound.viscous_per_hold = parts_.bounded_acceleration ? shaping : std::min(shaping, bound.viscous_per_hold);
    }
    sum += forces * bound.at(force.template segment<Size>(i * Size).norm() / whole);
  }
  return sum;
}

template <int Blocks, int Size>
void AolPlus<Blocks, Size>::adapt(const std::array<Friction, Blocks>& friction) noexcept {
  if (!parts_.adaptive_friction) return;
  target_ = friction;
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    const Friction now{.coulomb = std::min(friction_[i].coulomb, friction[i].coulomb),
                       .viscous = std::min(friction_[i].viscous, friction[i].viscous)};
    use(i, now);
  }
}

template class AolPlus<1>;
template class AolPlus<1, 3>;
template class AolPlus<3>;
template class AolPlus<6>;
template class AolPlus<2, 3>;

}  // namespace tendon
