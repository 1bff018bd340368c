// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clients/softbody/fem/lazy.h"
#include "clients/softbody/fem/mesh.h"
#include "clients/softbody/fem/patch.h"
#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {

/// Which displacements are fixed, and which are unknown. Component c of node i has the number 3 i + c; what an Elastic
/// has beside its nodes comes after them.
using Fixed = std::vector<bool>;

/// The number 3 i + c of every component of every node for which `holds(position)`.
template <class Predicate>
Fixed fix_where(const Mesh& mesh, Predicate holds) {
  Fixed fixed(3 * mesh.nodes.size());
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const bool held = holds(mesh.nodes[i]);
    for (std::size_t c = 0; c < 3; ++c) fixed[3 * i + c] = held;
  }
  return fixed;
}

/// A mesh, held somewhere, with an elastic energy: its value and its first two derivatives with respect to the
/// displacements u (m, all nodes). The energy has a minimum of 0 at u = 0, and nodes act on each other only within an
/// element.
///
/// Without state. Thread-safe: yes, once built. Realtime-safe: no.
class Elastic {
 public:
  virtual ~Elastic() = default;

  const Mesh& mesh() const noexcept { return mesh_; }

  /// Of u: 3 for each node, and further unknowns where there are some.
  int size() const noexcept { return static_cast<int>(free_of_.size()); }
  int free_count() const noexcept { return static_cast<int>(all_of_.size()); }
  int free_of(int component) const noexcept { return free_of_[at(component)]; }  ///< its number among the free, or −1
  Fixed fixed() const;
  VectorXd to_free(const VectorXd& all) const;
  void add_free(const VectorXd& free, VectorXd& all) const;  ///< all += free; the fixed ones stay

  /// The shape from which a solver begins, m: where the energy is one about another shape than that of the mesh, this.
  virtual VectorXd beginning() const { return VectorXd::Zero(size()); }

  virtual double energy(const VectorXd& u) const = 0;  ///< J
  /// ∂energy/∂u, N: the external forces that hold the nodes there.
  struct Forces {
    double energy;
    VectorXd force;
  };
  virtual Forces forces(const VectorXd& u) const = 0;

  enum class Curvature : std::uint8_t { kExact, kWithoutNegative };
  /// The second derivative with respect to the free displacements, N/m.
  virtual void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const = 0;
  /// Its pattern; all values are zero. Made when it is first asked for.
  const SymmetricMatrix& pattern() const;

  virtual std::size_t bytes() const noexcept = 0;

 protected:
  /// Throws std::invalid_argument when the mesh is not sound or nothing is fixed.
  Elastic(Mesh mesh, const Fixed& fixed);
  /// Further unknowns, which move the nodes of `rim` together: those are fixed by themselves.
  struct Together {
    int count = 0;
    std::vector<int> rim = {};
  };
  /// The same where something else may hold the body, and with further unknowns behind those of its nodes. They act on
  /// each other, and on every node that shares an element with the rim.
  Elastic(Mesh mesh, const Fixed& fixed, Together together);
  Elastic(const Elastic&) = default;
  Elastic(Elastic&&) = default;
  Elastic& operator=(const Elastic&) = default;
  Elastic& operator=(Elastic&&) = default;

  /// Where the entry of two components is among the pattern's values; −1: above the diagonal, or one is fixed.
  int slot(int row_component, int column_component) const;
  std::size_t mesh_bytes() const noexcept;  ///< of what this base keeps

 private:
  Mesh mesh_;
  std::vector<int> free_of_;  ///< by component
  std::vector<int> all_of_;   ///< by free component
  Together together_;
  Lazy<SymmetricMatrix> pattern_;
};

/// The mass of each free displacement, kg.
VectorXd lumped_mass(const Elastic& elastic, double density);

/// 1 N on the patch, against the normal, as forces on all nodes.
VectorXd patch_load(const Elastic& elastic, const Vec3& normal, const Patch& patch);

/// How patch_load() changes as the patch moves, N/m: a column for each axis across.
MatrixXd patch_load_slopes(const Elastic& elastic, const Vec3& normal, const Patch& patch);

/// The mean depth of a patch, m, and its derivative as the patch moves, for a body with the displacements u.
double depth_below(const Patch& patch, const Vec3& normal, const VectorXd& u);
Vec2 slope_below(const Patch& patch, const Vec3& normal, const VectorXd& u);
/// The second derivative; the patch has its curvatures.
Mat2 curve_below(const Patch& patch, const Vec3& normal, const VectorXd& u);

}  // namespace tendon::softbody
