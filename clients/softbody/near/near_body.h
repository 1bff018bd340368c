// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/near/pieces.h"

namespace tendon::softbody {

/// A solid in which only the elements near one place keep their nonlinear law. The others, the far field, are
/// linearized about a shape u* and condensed onto the shared nodes Γ, whose motion is restricted to a few modes Ψ. The
/// energy is
///
///     E(u_n, y) = Σ_near W_e(u) + r·y + ½ yᵀ S y,   u_Γ = u*_Γ + Ψ y,   r = Ψᵀ (force of the far elements on Γ at u*),
///     S = Ψᵀ (K_ΓΓ − K_Γf K_ff⁻¹ K_fΓ) Ψ,   K of the far elements at u*
///
/// It is exact to first order in the motion since u*, and a single energy, so forces are conservative. u* is the shape
/// at rest or one in which tools press near nodes only.
///
/// The modes are the leading singular vectors of the motion of Γ under random forces on near nodes, weighted towards
/// the center, in the whole body linearized about u*. Each such solution includes its own far field, so S Ψ is minus
/// the force of the near field on Γ, and the far field needs no factor.
///
/// As an Elastic it has the near nodes followed by y. The nodes of Γ count as fixed, and their entries of u are not
/// read. It has its own node numbering, see own_node(). It starts at u*, where its energy need not be 0.
///
/// Stateless. Thread-safe: yes, after construction. Realtime-safe: no.
class NearBody : public Elastic {
 public:
  struct Config {
    Vec3 middle = Vec3::Zero();  ///< m
    double radius = 0;           ///< m: an element is near if its center is within this distance of `middle`
    /// Upper limit; fewer are used if the others add less than 1e-3 (RMS) to the motion of Γ. With at least as many modes
    /// as Γ has unknowns the interface is exact.
    int modes = 60;
    std::vector<int> pressed;  ///< nodes that a tool may press; all their elements are near
    VectorXd press;            ///< N, free components of the whole: a typical tool load at `middle`
    VectorXd about{};          ///< u*, m, all nodes of the whole; empty: at rest
    double about_depth = 0;    ///< m: tool depth at u*
  };

  /// Builds the body in pieces; the last one sets `made`, to null if no element is far. `factor` is that of the whole
  /// stiffness at u*. It and `whole` must live until the last piece is done. The division into pieces is the same on
  /// every machine; most pieces solve for a few of the 2 modes + 1 loads.
  static Pieces make(const Solid& whole, const Factor& factor, Config config, std::unique_ptr<NearBody>& made);

  VectorXd beginning() const override { return beginning_; }
  double energy(const VectorXd& u) const override { return forces(u).energy; }
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;
  std::size_t bytes() const noexcept override;

  /// This body's number of a node of the whole solid; −1 if it is far or on Γ, where no tool may press.
  int own_node(int node) const noexcept { return own_of_[at(node)]; }

  int modes() const noexcept { return static_cast<int>(modes_.cols()); }
  int interface() const noexcept { return static_cast<int>(rim_.size()); }  ///< unknowns of Γ, which the modes replace

  /// Estimate of the force (N) that the far elements' own law would add on a tool at `depth` (m), at the shape v of the
  /// linear far field: z·(f(v) − f(u*) − K (v − u*)). z is the shape per metre of depth: v/depth, or that of u* if u*
  /// is deeper. Sampled on some elements next to Γ and scaled by their share of the total at a small press of the
  /// center.
  double left_out(const VectorXd& u, double depth) const;

 private:
  struct Parts;
  NearBody(Parts parts);

  VectorXd placed(const VectorXd& u) const;

  Solid part_;            ///< near elements; Γ is free in it
  std::vector<int> rim_;  ///< components of Γ that are free in `part_`
  MatrixXd modes_;        ///< Ψ
  MatrixXd far_;          ///< S
  VectorXd held_;         ///< r
  VectorXd on_rim_;       ///< u*_Γ, m
  VectorXd beginning_;
  double about_depth_;
  std::vector<int> own_of_;

  /// A solid linearized about u*.
  struct Linear {
    Linear() = default;
    Linear(const Solid& solid, VectorXd u);
    /// Work (J) along `along` of the nonlinear forces beyond the linearized ones, at the motion `moved` from u*.
    double excess(const Solid& solid, const VectorXd& moved, const VectorXd& along) const;
    VectorXd about;   ///< u*, m
    VectorXd forces;  ///< N, free components
    SymmetricMatrix stiffness;
  };
  /// Sampled far elements next to Γ.
  struct Watched {
    Solid part;
    Linear linear{};
    MatrixXd followed{};  ///< their displacements from u* per mode
    double share = 1;
  };
  Watched watched_;
};

}  // namespace tendon::softbody
