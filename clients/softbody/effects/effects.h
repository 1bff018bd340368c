// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// An effect on the whole body: in each time step a quadratic energy of the free displacements u. The body moves to the
/// minimum of the total energy; with inertia this is the implicit Euler method. Thread-safe: no. Realtime-safe: no.
class Effect {
 public:
  Effect() = default;
  virtual ~Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  virtual double energy(const VectorXd& u) const = 0;                    ///< J, up to a constant
  virtual void add_force(const VectorXd& u, VectorXd& force) const = 0;  ///< N, −∂energy/∂u
  virtual void add_stiffness(SymmetricMatrix& to) const = 0;             ///< N/m, ∂²energy/∂u², which is constant
  virtual void advance(const VectorXd& u) = 0;                           ///< ends the step at u
  virtual std::size_t bytes() const noexcept = 0;
};

/// Weight: energy −Σ m g·u.
class Gravity : public Effect {
 public:
  /// `acceleration`: m/s², body frame; `density`: kg/m³.
  Gravity(const Elastic& elastic, const Vec3& acceleration, double density);
  double energy(const VectorXd& u) const override { return -weight_.dot(u); }
  void add_force(const VectorXd&, VectorXd& force) const override { force += weight_; }
  void add_stiffness(SymmetricMatrix&) const override {}
  void advance(const VectorXd&) override {}
  std::size_t bytes() const noexcept override;

 private:
  VectorXd weight_;  ///< N
};

/// Viscous drag on every particle, −rate·m·v: energy ½ Σ rate/dt m (u − u₀)². It also slows rigid motion, so it only
/// serves to bring a body to rest; it is not a tissue model.
class Damping : public Effect {
 public:
  Damping(const Elastic& elastic, const VectorXd& u, double density, double rate, double dt);
  double energy(const VectorXd& u) const override;
  void add_force(const VectorXd& u, VectorXd& force) const override;
  void add_stiffness(SymmetricMatrix& to) const override;
  void advance(const VectorXd& u) override { about_ = u; }
  std::size_t bytes() const noexcept override;

 protected:
  Damping(VectorXd weight, VectorXd u) : weight_(std::move(weight)), about_(std::move(u)) {}

  VectorXd weight_;  ///< rate·m/dt, N/m
  VectorXd about_;   ///< u₀, m
};

/// Inertia: energy ½ Σ m (u − u₀ − v₀ dt)² / dt² for a step from u₀ with velocity v₀. This is a drag with the rate 1/dt
/// about u₀ + v₀ dt.
class Inertia : public Damping {
 public:
  Inertia(const Elastic& elastic, const VectorXd& u, double density, double dt);
  void advance(const VectorXd& u) override;
  std::size_t bytes() const noexcept override;

 private:
  VectorXd start_;  ///< u₀, m
};

/// A Kelvin–Voigt material: the stress of a strain ε is that of ε + τ ∂ε/∂t. The energy is ½ τ/dt (u − u₀)ᵀ K₀ (u −
/// u₀), where K₀ is the stiffness at rest. It also slows down rigid rotation, so it is valid for small rotations only.
class Viscosity : public Effect {
 public:
  Viscosity(const Elastic& elastic, const VectorXd& u, double relaxation, double dt);
  double energy(const VectorXd& u) const override;
  void add_force(const VectorXd& u, VectorXd& force) const override;
  void add_stiffness(SymmetricMatrix& to) const override;
  void advance(const VectorXd& u) override { start_ = u; }
  std::size_t bytes() const noexcept override;

 private:
  SymmetricMatrix resistance_;  ///< τ/dt K₀, N/m
  VectorXd start_;              ///< u₀, m
};

/// If a member is empty or false, the effect is not simulated.
struct EffectsConfig {
  double density = 0;                ///< kg/m³, positive; for gravity, inertia and damping
  double step = 0;                   ///< s, positive: time step of an answer; for inertia, damping and viscosity
  std::optional<Vec3> gravity = {};  ///< m/s², in the body's frame
  bool inertia = false;
  std::optional<double> damping = {};    ///< 1/s
  std::optional<double> viscosity = {};  ///< s

  bool has_time() const noexcept { return inertia || damping || viscosity; }
};

void check(const EffectsConfig& config);  ///< throws std::invalid_argument with the name of an invalid field

using Effects = std::vector<std::unique_ptr<Effect>>;

/// Create the effects on a body at rest, and those of motion, starting from rest at u (m, free displacements).
Effects effects_at_rest(const EffectsConfig& config, const Elastic& elastic);
void add_effects_of_time(Effects& effects, const EffectsConfig& config, const Elastic& elastic, const VectorXd& u);

/// Adds the energies and the free forces at u (m, all nodes) to `to`.
void add_forces(const Effects& effects, const Elastic& elastic, const VectorXd& u, Elastic::Forces& to);

std::size_t bytes(const Effects& effects) noexcept;

}  // namespace tendon::softbody
