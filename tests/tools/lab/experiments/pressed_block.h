// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/material.h"
#include "clients/softbody/models/linear.h"

namespace tendon::lab {

/// Fixed at the bottom and pressed by a patch on its top. The defaults are B1 of clients/softbody/README.md.
struct PressedBlock {
  softbody::Vec3 size{0.1, 0.1, 0.05};  ///< m
  softbody::Material material{.young = 1e4, .poisson = 0.45};
  double patch_radius = 0.02;                            ///< m
  softbody::Vec2 patch_centre = softbody::Vec2::Zero();  ///< m, from the center of the top
  std::array<double, 2> loads{0.3, 1};                   ///< N: one for small strains and a large one

  /// Throws std::invalid_argument naming the invalid option.
  void check() const;
  /// m; the body stands on z = 0, centered at the origin.
  softbody::Vec3 touch_point() const { return {patch_centre.x(), patch_centre.y(), size.z()}; }
};

struct Stiffness {
  double secant = 0;   ///< N/m, load over mean depth of the patch
  double tangent = 0;  ///< N/m
};

struct Touched {
  softbody::Vec3 tool;
  softbody::Vec3 force;
};

/// The reference solution, on demand, with quadratic hexahedra refined below the patch. The Neo-Hookean stiffness is
/// that of the linear body on the fine mesh times the ratio of both on a mesh that is coarse enough for Newton's
/// method:
///
///     K = K_linear(a/cells) · K_neo-Hookean(a/cells_for_large)/K_linear(a/cells_for_large)
///
/// because the ratio hardly depends on the mesh. `uncertainty()` is the change of both factors from the next coarser
/// mesh.
///
/// Thread-safe: no.
class Truth {
 public:
  /// Cells per patch radius below the patch, at least 1.5. The defaults take half a minute and 0.3 GB for B1.
  struct Config {
    double cells = 4;
    double cells_for_large = 2;  ///< for meshes solved by Newton's method
  };
  Truth(const PressedBlock& block, const Config& config);
  ~Truth();
  Truth(const Truth&) = delete;
  Truth& operator=(const Truth&) = delete;

  const PressedBlock& block() const noexcept { return block_; }

  Stiffness stiffness(std::size_t load);

  /// The stiffness of `law` on an infinitely fine mesh; nullopt if that body collapses under the load.
  std::optional<Stiffness> limit(softbody::Law law, std::size_t load) { return limit(law, block_.material, load); }
  std::optional<Stiffness> limit(softbody::Law law, const softbody::Material& material, std::size_t load);

  double uncertainty();  ///< relative, of the stiffness under the second load

  /// For a tool within a quarter of the patch radius from the center: the linear body's force times 1 + αF + βF², which
  /// is exact for both loads at the center.
  softbody::Vec3 force(const softbody::Vec3& tool);

  /// The tool presses to the depth of the first load, slides by a quarter of the patch radius, and releases. Sampled
  /// every `kScriptInterval`.
  static constexpr double kScriptInterval = 0.03;  ///< s
  const std::vector<Touched>& script();

 private:
  struct Fine;
  struct Factor {
    double alpha;  ///< 1/N
    double beta;   ///< 1/N²
  };
  const Factor& factor();
  using AtLoads = std::array<std::optional<Stiffness>, 2>;
  /// Ratios of K to that of the linear body; empty from the load at which it collapses.
  AtLoads ratios(softbody::Law law, const softbody::Material& material, double cells) const;

  PressedBlock block_;
  Config config_;
  std::unique_ptr<Fine> fine_;
  double linear_ = 0;                                                    ///< N/m
  std::map<std::tuple<softbody::Law, double, double>, AtLoads> limits_;  ///< by law, Young's modulus, Poisson's ratio
  std::optional<double> uncertainty_;
  std::optional<Factor> factor_;
  std::vector<Touched> script_;
};

}  // namespace tendon::lab
