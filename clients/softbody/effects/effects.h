// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// An effect beside elasticity on the whole body. Within one time step it is an energy, quadratic in the free
/// displacements u, and the body moves to the minimum of the sum of all energies; with inertia that is the implicit
/// Euler method. An effect that a scene does not list is not constructed, has no state, and costs a step no
/// instruction.
///
/// Thread-safe: no. Realtime-safe: no.
class Effect {
 public:
  Effect() = default;
  virtual ~Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  virtual double energy(const VectorXd& u) const = 0;                    ///< J, up to a constant
  virtual void add_force(const VectorXd& u, VectorXd& force) const = 0;  ///< N, −∂energy/∂u
  virtual void add_stiffness(SymmetricMatrix& to) const = 0;             ///< N/m, ∂²energy/∂u², which is constant
  virtual void advance(const VectorXd& u) = 0;                           ///< a step ends at u; the next begins there
  virtual std::size_t bytes() const noexcept = 0;
};

/// Weight: −Σ m g·u.
class Gravity : public Effect {
 public:
  /// `acceleration` in the body's frame, m/s²; `density` kg/m³.
  Gravity(const Elastic& elastic, const Vec3& acceleration, double density);
  double energy(const VectorXd& u) const override { return -weight_.dot(u); }
  void add_force(const VectorXd&, VectorXd& force) const override { force += weight_; }
  void add_stiffness(SymmetricMatrix&) const override {}
  void advance(const VectorXd&) override {}
  std::size_t bytes() const noexcept override;

 private:
  VectorXd weight_;  ///< N
};

/// Inertia: ½ Σ m (u − u₀ − v₀ dt)² / dt², for a step from u₀ with the velocity v₀.
class Inertia : public Effect {
 public:
  Inertia(const Elastic& elastic, const VectorXd& u, double density, double dt);
  double energy(const VectorXd& u) const override;
  void add_force(const VectorXd& u, VectorXd& force) const override;
  void add_stiffness(SymmetricMatrix& to) const override;
  void advance(const VectorXd& u) override;
  std::size_t bytes() const noexcept override;

 private:
  VectorXd weight_;  ///< m/dt², N/m
  VectorXd start_;   ///< u₀, m
  VectorXd ahead_;   ///< u₀ + v₀ dt, m
};

/// Viscous drag on every particle, −rate·m·v: ½ Σ rate/dt m (u − u₀)². It also slows a body that moves as a whole, so
/// it serves to bring a body to rest and does not model tissue.
class Damping : public Effect {
 public:
  /// `rate` 1/s.
  Damping(const Elastic& elastic, const VectorXd& u, double density, double rate, double dt);
  double energy(const VectorXd& u) const override;
  void add_force(const VectorXd& u, VectorXd& force) const override;
  void add_stiffness(SymmetricMatrix& to) const override;
  void advance(const VectorXd& u) override { start_ = u; }
  std::size_t bytes() const noexcept override;

 private:
  VectorXd drag_;   ///< rate·m/dt, N/m
  VectorXd start_;  ///< u₀, m
};

/// A material that resists fast deformation (Kelvin and Voigt): a strain ε has the stress of ε + τ ∂ε/∂t. With the
/// stiffness K₀ of the body at rest: ½ τ/dt (u − u₀)ᵀ K₀ (u − u₀). Valid for small rotations only: a body that turns as
/// a whole is slowed too.
class Viscosity : public Effect {
 public:
  /// `relaxation` τ, s.
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

/// The effects of a scene. Empty or false: not simulated, costs nothing.
struct EffectsConfig {
  double density = 0;                    ///< kg/m³, above 0; for gravity, inertia and damping
  double step = 0;                       ///< s, above 0: the time step of an answer; for effects with time
  std::optional<Vec3> gravity = {};      ///< m/s², in the body's frame
  bool inertia = false;                  ///< has time, as the next two have
  std::optional<double> damping = {};    ///< 1/s
  std::optional<double> viscosity = {};  ///< s

  bool has_time() const noexcept { return inertia || damping || viscosity; }
};

/// Throws std::invalid_argument that names the field.
void check(const EffectsConfig& config);

using Effects = std::vector<std::unique_ptr<Effect>>;

/// The effects that act even on a body at rest; and those that act only on a moving body, which starts from rest at u
/// (m, free displacements).
Effects effects_at_rest(const EffectsConfig& config, const Elastic& elastic);
void add_effects_of_time(Effects& effects, const EffectsConfig& config, const Elastic& elastic, const VectorXd& u);

/// Adds the effects' energy and forces at u (m, all nodes) to those of elasticity; forces on free displacements.
void add_forces(const Effects& effects, const Elastic& elastic, const VectorXd& u, Elastic::Forces& to);

std::size_t bytes(const Effects& effects) noexcept;

}  // namespace tendon::softbody
