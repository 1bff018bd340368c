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

/// True for fixed displacements. Component c of node i has index 3 i + c; further unknowns of an Elastic follow.
using Fixed = std::vector<bool>;

/// Fixes all components of the nodes for which `holds(position)` is true.
template <class Predicate>
Fixed fix_where(const Mesh& mesh, Predicate holds) {
  Fixed fixed(3 * mesh.nodes.size());
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const bool held = holds(mesh.nodes[i]);
    for (std::size_t c = 0; c < 3; ++c) fixed[3 * i + c] = held;
  }
  return fixed;
}

/// A mesh with an elastic energy: its value and first two derivatives with respect to the displacements u of all nodes,
/// in m. The energy has its minimum, 0, at u = 0. Two nodes interact only if they share an element.
/// Stateless. Thread-safe: yes, after construction. Realtime-safe: no.
class Elastic {
 public:
  virtual ~Elastic() = default;

  const Mesh& mesh() const noexcept { return mesh_; }

  int size() const noexcept { return static_cast<int>(free_of_.size()); }  ///< of u: 3 per node, and further unknowns
  int free_count() const noexcept { return static_cast<int>(all_of_.size()); }
  int free_of(int component) const noexcept { return free_of_[at(component)]; }
  Fixed fixed() const;
  VectorXd to_free(const VectorXd& all) const;
  void add_free(const VectorXd& free, VectorXd& all) const;  ///< all += free

  virtual VectorXd beginning() const { return VectorXd::Zero(size()); }  ///< initial displacements of a solver (m)

  virtual double energy(const VectorXd& u) const = 0;
  struct Forces {  // force = ∂energy/∂u, N: the external forces that hold the nodes at u
    double energy;
    VectorXd force;
  };
  virtual Forces forces(const VectorXd& u) const = 0;

  enum class Curvature : std::uint8_t { kExact, kWithoutNegative };
  /// The second derivative with respect to the free displacements, N/m.
  virtual void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const = 0;
  SymmetricMatrix exact_stiffness(const VectorXd& u) const;
  const SymmetricMatrix& pattern() const;  ///< all values are zero

  virtual std::size_t bytes() const noexcept = 0;

 protected:
  Elastic(Mesh mesh, const Fixed& fixed);  ///< throws std::invalid_argument if the mesh is invalid or nothing is fixed
  struct Together {  // additional unknowns that move the nodes of `rim`, whose components are fixed
    int count = 0;
    std::vector<int> rim = {};
  };
  /// The mesh may be held by another body, so no node has to be fixed. The additional unknowns are coupled to all nodes
  /// that share an element with the rim.
  Elastic(Mesh mesh, const Fixed& fixed, Together together);
  Elastic(const Elastic&) = default;
  Elastic(Elastic&&) = default;
  Elastic& operator=(const Elastic&) = default;
  Elastic& operator=(Elastic&&) = default;

  int slot(int row_component, int column_component) const;  ///< −1 above the diagonal and for fixed components
  std::size_t mesh_bytes() const noexcept;

 private:
  Mesh mesh_;
  std::vector<int> free_of_;
  std::vector<int> all_of_;
  Together together_;
  Lazy<SymmetricMatrix> pattern_;
};

VectorXd lumped_mass(const Elastic& elastic, double density);  ///< lumped masses (kg)

/// Returns the factor of a stiffness. Throws std::runtime_error if the body can move as a whole.
Factor factor_of(const SymmetricMatrix& stiffness);

Vec3 place_of(const Mesh& mesh, const Patch& patch);  ///< m, weighted mean of the nodes at rest

/// Returns the forces of 1 N on the patch, against the normal.
VectorXd patch_load(const Elastic& elastic, const Vec3& normal, const Patch& patch);

/// The derivative of patch_load() with respect to the patch position, N/m.
MatrixXd patch_load_slopes(const Elastic& elastic, const Vec3& normal, const Patch& patch);

/// The mean depth of a patch, m, and its derivatives with respect to the patch position.
double depth_below(const Patch& patch, const Vec3& normal, const VectorXd& u);
Vec2 slope_below(const Patch& patch, const Vec3& normal, const VectorXd& u);
Mat2 curve_below(const Patch& patch, const Vec3& normal, const VectorXd& u);

}  // namespace tendon::softbody
