// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/near/pieces.h"

namespace tendon::softbody {

/// A solid of which only the elements around one place keep their law. The others, the far field, are linear about one
/// shape u* of the body, and condensed onto the nodes Γ that both have. What Γ does is a sum of few modes Ψ, and the
/// energy is
///
///     E(u_n, y) = Σ_near W_e(u) + r·y + ½ yᵀ S y,   u_Γ = u*_Γ + Ψ y,   r = Ψᵀ (force of the far elements on Γ at u*),
///     S = Ψᵀ (K_ΓΓ − K_Γf K_ff⁻¹ K_fΓ) Ψ,   K of the far elements at u*
///
/// It is exact to the first order of what has moved since u*, and one energy, so that the forces give nothing on a
/// closed way. u* is the shape at rest, or one in which tools hold near nodes only.
///
/// The modes are the leading singular vectors of what random forces on near nodes, the stronger the closer to the
/// middle, do to Γ in the whole body, linear about u*. Each such solution has its own far field, so that S Ψ is the
/// force of the near field on Γ with the sign turned, and no factor of the far field is needed.
///
/// As an Elastic it has the near nodes, and behind them y. The nodes of Γ count as fixed: their own entries of u are not
/// read. Its nodes have numbers of their own; see own_node(). It begins at u*, where its energy need not be 0.
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
    VectorXd about{};          ///< u*, m, all nodes of the whole; empty: the shape at rest
    double about_depth = 0;    ///< m: how deep a tool is in u*
  };

  /// The last piece sets `made`: null when no element is far. `factor` is that of the whole stiffness at u*; it and
  /// `whole` may die when all pieces are done. There are the same pieces on every machine. Most are solutions for
  /// a few of the 2 modes + 1 loads.
  static Pieces make(const Solid& whole, const Factor& factor, Config config, std::unique_ptr<NearBody>& made);

  VectorXd beginning() const override { return beginning_; }
  double energy(const VectorXd& u) const override { return forces(u).energy; }
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;
  std::size_t bytes() const noexcept override;

  /// The number here of a node of the whole solid; −1 where it is far or on Γ, so that no tool may press there.
  int own_node(int node) const noexcept { return own_of_[at(node)]; }

  int modes() const noexcept { return static_cast<int>(modes_.cols()); }
  int interface() const noexcept { return static_cast<int>(rim_.size()); }  ///< unknowns of Γ, which the modes replace

  /// N: what the far elements' own law would add to the force on a tool at `depth` (m), in the shape v that the linear
  /// far field has at u: z·(f(v) − f(u*) − K (v − u*)), with z the shape for each metre of depth, v/depth or, where u* is
  /// deeper, that of u*. Only some elements are asked, those next to Γ, and counted for all by their share of it at a
  /// small press of the middle.
  double left_out(const VectorXd& u, double depth) const;

 private:
  struct Parts;
  NearBody(Parts parts);

  VectorXd placed(const VectorXd& u) const;

  Solid part_;            ///< the near elements; Γ is free in it
  std::vector<int> rim_;  ///< the components of Γ that are free in `part_`
  MatrixXd modes_;        ///< Ψ
  MatrixXd far_;          ///< S
  VectorXd held_;         ///< r
  VectorXd on_rim_;       ///< u*_Γ, m
  VectorXd beginning_;
  double about_depth_;
  std::vector<int> own_of_;

  /// A solid as it is about u*.
  struct Linear {
    Linear() = default;
    Linear(const Solid& solid, VectorXd u);
    /// J: what the solid's law adds to the linear forces of a shape that has moved so far from u*, in work along another.
    double excess(const Solid& solid, const VectorXd& moved, const VectorXd& along) const;
    VectorXd about;   ///< u*, m
    VectorXd forces;  ///< N, free ones
    SymmetricMatrix stiffness;
  };
  /// Far elements next to Γ.
  struct Watched {
    Solid part;
    Linear linear{};
    MatrixXd followed{};  ///< their displacements from u*, for each mode
    double share = 1;
  };
  Watched watched_;
};

}  // namespace tendon::softbody
