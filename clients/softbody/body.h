// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "clients/softbody/contact.h"
#include "clients/softbody/quasi_static.h"

namespace tendon::softbody {

/// The models that a scene can choose, each a file of this folder.
enum class ModelKind : std::uint8_t { kLinear, kCondensed, kCorotational, kStVenantKirchhoff, kNeoHookean };

struct ModelInfo {
  ModelKind kind;
  Law law;
  std::string_view name;  ///< in scenes, tables and command lines
  std::string_view what;  ///< one line
  bool large_rotations;   ///< simulates the effect "geometric-nonlinearity"
  bool large_strains;     ///< simulates the effect "material-nonlinearity"
};

/// Every model, in the order in which tables list them.
std::span<const ModelInfo> models() noexcept;
const ModelInfo& info(ModelKind kind) noexcept;
std::optional<ModelKind> model_named(std::string_view name) noexcept;

struct BlockShape {
  Vec3 size;  ///< m
  std::array<int, 3> cells;
};
struct CylinderShape {
  double radius;  ///< m
  double height;  ///< m
  int across;     ///< cells from side to side of its core
  int up;         ///< cells along its axis
};
struct FileShape {
  std::filesystem::path file;
  double scale;  ///< from the file's units to m
};

/// A soft body that a tool touches, as plain values. Blocks and cylinders stand on z = 0.
struct BodyConfig {
  std::variant<BlockShape, CylinderShape, FileShape> shape;
  Element element = Element::kHex8Sri;
  Material material;
  ModelKind model = ModelKind::kCondensed;
  int max_iterations = QuasiStaticModel::Config{}.max_iterations;
  double clamped_below = 0;  ///< m; nodes up to so far above the lowest one are held. The lowest ones always are

  Vec3 towards_tool = Vec3::UnitZ();  ///< unit vector, body frame
  double patch_radius = 0;            ///< m
  std::optional<double> reach;        ///< m, how far from `middle` it can be touched (kCondensed); empty: anywhere
  Vec3 middle = Vec3::Zero();         ///< m; its place across `towards_tool` counts
  double tool_radius = 0;             ///< m; 0: a point
  PatchContact::Side side = PatchContact::Side::kUnilateral;
};

/// Mesh, model and contact of one body, built from a BodyConfig. Thread-safe: no. Realtime-safe: no.
class Body {
 public:
  /// Throws std::invalid_argument with a sentence when the values make no body.
  explicit Body(const BodyConfig& config);
  ~Body();
  Body(Body&&) noexcept;
  Body& operator=(Body&&) noexcept;

  Feel touch(const Vec3& tool);

  /// The model under a patch around the middle: stiffness and force of scripted presses.
  Reaction press(Given given, double value);

  /// The point of the surface at rest above `middle`, and the way to the tool there; body frame.
  Vec3 touch_point() const;
  const Vec3& normal() const;

  struct Size {
    std::size_t nodes;
    std::size_t elements;
    std::size_t free;       ///< displacements to be found
    std::size_t touchable;  ///< nodes
    std::size_t bytes;      ///< kept by the model
  };
  Size size() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tendon::softbody
