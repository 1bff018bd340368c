// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/near/pieces.h"

namespace tendon::softbody {

/// A solid of which only the elements around one place keep their law. The others, the far field, are linear about the
/// shape at rest, and condensed onto the nodes Γ that both have. What Γ does is a sum of few modes Ψ, and the energy is
///
///     E(u_n, y) = Σ_near W_e(u) + ½ yᵀ S y,   u_Γ = Ψ y,   S = Ψᵀ (K_ΓΓ − K_Γf K_ff⁻¹ K_fΓ) Ψ      (K of the far field)
///
/// The modes are the leading singular vectors of what random forces on near nodes, the stronger the closer to the
/// middle, do to Γ in the whole linear body. Each such solution has its own far field, so that S Ψ is the force of the
/// near field on Γ with the sign turned, and no factor of the far field is needed.
///
/// As an Elastic it has the near nodes, and behind them y. The nodes of Γ count as fixed: their own entries of u are not
/// read. Its nodes have numbers of their own; see own_node().
///
/// Without state. Thread-safe: yes, once built. Realtime-safe: no.
class NearBody : public Elastic {
 public:
  struct Config {
    Vec3 middle = Vec3::Zero();  ///< m
    double radius = 0;           ///< m: an element is near when its middle is not farther from there
    /// At most; fewer where these leave 1e-3 of the traces. As many as Γ has unknowns, or more: the exact interface.
    int modes = 60;
    std::vector<int> pressed;  ///< nodes where a tool may press; all elements of these are near, too
    VectorXd press;            ///< N, free components of the whole: a load as a tool at the middle gives it
  };

  /// The last piece sets `made`: null when no element is far. `at_rest` is the factor of the whole stiffness at rest;
  /// it and `whole` may die when all pieces are done. There are the same pieces on every machine. Most are solutions for
  /// a few of the 2 modes + 1 loads.
  static Pieces make(const Solid& whole, const Factor& at_rest, Config config, std::unique_ptr<NearBody>& made);

  double energy(const VectorXd& u) const override { return forces(u).energy; }
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;
  std::size_t bytes() const noexcept override;

  /// The number here of a node of the whole solid; −1 where it is far or on Γ, so that no tool may press there.
  int own_node(int node) const noexcept { return own_of_[at(node)]; }

  int modes() const noexcept { return static_cast<int>(modes_.cols()); }
  int interface() const noexcept { return static_cast<int>(rim_.size()); }  ///< unknowns of Γ, which the modes replace

  /// J: u·(f − K u) summed over the far elements, with f their force by their law in the shape that the linear far field
  /// has at u, and K their stiffness at rest. The energy that their law adds to the linear one begins with the third
  /// power of u, so that this is three times as much. Only some elements are asked, those next to Γ; `share` is what
  /// they had of all at a small press of the middle.
  double left_out(const VectorXd& u) const;

 private:
  struct Parts;
  NearBody(Parts parts);

  VectorXd placed(const VectorXd& u) const;

  Solid part_;            ///< the near elements; Γ is free in it
  std::vector<int> rim_;  ///< the components of Γ that are free in `part_`
  MatrixXd modes_;        ///< Ψ
  MatrixXd far_;          ///< S
  std::vector<int> own_of_;

  Solid watched_;           ///< far elements next to Γ
  SymmetricMatrix linear_;  ///< their stiffness at rest
  MatrixXd followed_;       ///< their nodes' displacements, for each mode
  double watched_share_ = 1;
};

}  // namespace tendon::softbody
