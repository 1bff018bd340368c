// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/effects/effects.h"

#include <cmath>
#include <string>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

std::size_t bytes_of(const VectorXd& vector) noexcept {
  return static_cast<std::size_t>(vector.size()) * sizeof(double);
}

}  // namespace

Gravity::Gravity(const Elastic& elastic, const Vec3& acceleration, double density)
    : weight_(
          lumped_mass(elastic, density).cwiseProduct(elastic.to_free(acceleration.replicate(elastic.size() / 3, 1)))) {}

std::size_t Gravity::bytes() const noexcept { return sizeof *this + bytes_of(weight_); }

Damping::Damping(const Elastic& elastic, const VectorXd& u, double density, double rate, double dt)
    : Damping(lumped_mass(elastic, density) * (rate / dt), u) {}

double Damping::energy(const VectorXd& u) const { return 0.5 * weight_.dot((u - about_).cwiseAbs2()); }

void Damping::add_force(const VectorXd& u, VectorXd& force) const { force -= weight_.cwiseProduct(u - about_); }

void Damping::add_stiffness(SymmetricMatrix& to) const {
  for (int i = 0; i < to.size; ++i) to.values[at(to.column_starts[at(i)])] += weight_[i];
}

std::size_t Damping::bytes() const noexcept { return sizeof *this + bytes_of(weight_) + bytes_of(about_); }

Inertia::Inertia(const Elastic& elastic, const VectorXd& u, double density, double dt)
    : Damping(lumped_mass(elastic, density) / (dt * dt), u), start_(u) {}

void Inertia::advance(const VectorXd& u) {
  about_ = 2 * u - start_;  // v₀ dt = u − u₀
  start_ = u;
}

std::size_t Inertia::bytes() const noexcept { return Damping::bytes() + sizeof start_ + bytes_of(start_); }

Viscosity::Viscosity(const Elastic& elastic, const VectorXd& u, double relaxation, double dt)
    : resistance_(elastic.exact_stiffness(VectorXd::Zero(elastic.size()))), start_(u) {
  for (double& value : resistance_.values) value *= relaxation / dt;
}

double Viscosity::energy(const VectorXd& u) const {
  const VectorXd moved = u - start_;
  return 0.5 * moved.dot(resistance_.times(moved));
}

void Viscosity::add_force(const VectorXd& u, VectorXd& force) const { force -= resistance_.times(u - start_); }

void Viscosity::add_stiffness(SymmetricMatrix& to) const {
  for (std::size_t i = 0; i < to.values.size(); ++i) to.values[i] += resistance_.values[i];
}

std::size_t Viscosity::bytes() const noexcept { return sizeof *this + resistance_.bytes() + bytes_of(start_); }

void check(const EffectsConfig& config) {
  if (config.gravity || config.inertia || config.damping) expect_above_zero(config.density, "density");
  if (config.has_time()) expect_above_zero(config.step, "step");
  if (config.damping) expect_above_zero(*config.damping, "damping");
  if (config.viscosity) expect_above_zero(*config.viscosity, "viscosity");
  if (config.gravity) expect_finite(*config.gravity, "gravity");
}

void add_forces(const Effects& effects, const Elastic& elastic, const VectorXd& u, Elastic::Forces& to) {
  const VectorXd free = elastic.to_free(u);
  VectorXd force = VectorXd::Zero(free.size());
  for (const auto& effect : effects) {
    effect->add_force(free, force);
    to.energy += effect->energy(free);
  }
  to.force -= force;
}

Effects effects_at_rest(const EffectsConfig& config, const Elastic& elastic) {
  check(config);
  Effects effects;
  if (config.gravity) effects.push_back(std::make_unique<Gravity>(elastic, *config.gravity, config.density));
  return effects;
}

void add_effects_of_time(Effects& effects, const EffectsConfig& config, const Elastic& elastic, const VectorXd& u) {
  if (config.inertia) effects.push_back(std::make_unique<Inertia>(elastic, u, config.density, config.step));
  if (config.damping) {
    effects.push_back(std::make_unique<Damping>(elastic, u, config.density, *config.damping, config.step));
  }
  if (config.viscosity) {
    effects.push_back(std::make_unique<Viscosity>(elastic, u, *config.viscosity, config.step));
  }
}

std::size_t bytes(const Effects& effects) noexcept {
  std::size_t sum = 0;
  for (const auto& effect : effects) sum += effect->bytes() + sizeof effect;
  return sum;
}

}  // namespace tendon::softbody
