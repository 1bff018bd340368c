// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/near/pieces.h"

namespace tendon::softbody {

/// A solid in which only the elements near the tool have a nonlinear law. The far field is linear about a shape u*,
/// condensed to the common nodes Γ, whose motion is limited to some modes Ψ. The energy is
///
///     E(u_n, y) = Σ_near W_e(u) + r·y + ½ yᵀ S y,   u_Γ = u*_Γ + Ψ y,   r = Ψᵀ (force of the far elements on Γ at u*),
///     S = Ψᵀ (K_ΓΓ − K_Γf K_ff⁻¹ K_fΓ) Ψ,   K of the far elements at u*
///
/// It is exact to first order at u*, which is the shape at rest or a shape with tools on near nodes.
///
/// The modes are singular vectors of the motion of Γ for random forces on near nodes, larger close to the center. Each
/// motion is a solution of the whole body, linear about u*, so the forces of the near field on Γ are −S Ψ, and the far
/// field needs no factor. The unknowns are the near nodes and y. The nodes of Γ count as fixed, and their values in u
/// are ignored; own_node() numbers the nodes. The initial shape is u*, whose energy can differ from 0.
///
/// Stateless. Thread-safe: yes, after construction. Realtime-safe: no.
class NearBody : public Elastic {
 public:
  struct Config {
    Vec3 middle = Vec3::Zero();  ///< m
    double radius = 0;           ///< m, maximum distance of the centers of near elements
    int modes = 60;              ///< at most; the interface is exact if Γ has no more unknowns
    std::vector<int> pressed;
    VectorXd press;          ///< N: the load of a tool at `middle`
    VectorXd about{};        ///< u*, m; empty: at rest
    double about_depth = 0;  ///< m, depth of the tool in u*
  };

  /// Builds the body in pieces, most of which are solves for a few loads. The last piece sets `made`, which is null if
  /// all elements are near. `factor` is the factor at u*. `whole` and `factor` must outlive the pieces.
  static Pieces make(const Solid& whole, const Factor& factor, Config config, std::unique_ptr<NearBody>& made);

  VectorXd beginning() const override { return beginning_; }
  double energy(const VectorXd& u) const override { return forces(u).energy; }
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;
  std::size_t bytes() const noexcept override;

  /// Returns the number of a node of the whole solid in this body, or −1 if the tool may not press it.
  int own_node(int node) const noexcept { return own_of_[at(node)]; }

  int modes() const noexcept { return static_cast<int>(modes_.cols()); }
  int interface() const noexcept { return static_cast<int>(rim_.size()); }

  /// Estimates the force (N) at `depth` (m) that the linear far field misses: z·(f(v) − f(u*) − K (v − u*)), v its
  /// shape, z the shape per depth. Only some elements next to Γ are evaluated, and the result is scaled.
  double left_out(const VectorXd& u, double depth) const;

 private:
  struct Parts;
  NearBody(Parts parts);

  VectorXd placed(const VectorXd& u) const;

  Solid part_;
  std::vector<int> rim_;  ///< free components of Γ in `part_`
  MatrixXd modes_;        ///< Ψ
  MatrixXd far_;          ///< S
  VectorXd held_;         ///< r
  VectorXd on_rim_;       ///< u*_Γ, m
  VectorXd beginning_;
  double about_depth_;
  std::vector<int> own_of_;

  struct Linear {
    Linear() = default;
    Linear(const Solid& solid, VectorXd u);
    /// Returns the work (J) of the nonlinear part of the forces along `along`.
    double excess(const Solid& solid, const VectorXd& moved, const VectorXd& along) const;
    VectorXd about;   ///< u*, m
    VectorXd forces;  ///< N, free
    SymmetricMatrix stiffness;
  };
  struct Watched {
    Solid part;
    Linear linear{};
    MatrixXd followed{};  ///< displacements of each mode
    double share = 1;
  };
  Watched watched_;
};

}  // namespace tendon::softbody
