// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::softbody::compared {

/// Compared with the models of clients/softbody. Scenes cannot use them.
enum class Kind : std::uint8_t { kStVenantKirchhoff, kMassSpring, kTensorMass, kTled, kXpbd, kProjective, kModal };

struct Info {
  Kind kind;
  Law law;
  std::string_view name;  ///< in tables and command lines
  std::string_view what;
  bool has_time;    ///< a press is a time step, which requires inertia
  bool tetrahedra;  ///< requires Element::kTet4
};

std::span<const Info> models() noexcept;
const Info& info(Kind kind) noexcept;
std::optional<Kind> named(std::string_view name) noexcept;

struct Config {
  EffectsConfig effects{};
  int iterations = 10;           ///< kXpbd, kProjective: per press
  int swings = 30;               ///< kModal: number of vibration modes
  int static_modes = 0;          ///< kModal: number of static modes per axis
  double reach = 0;              ///< m, kModal: half the width of the square that contains the static modes
  bool whole_stiffness = false;  ///< kModal: see BodyConfig::whole_stiffness
};

/// Pressed from above by a patch; corresponds to softbody::Body. Thread-safe: no.
class PressedBody {
 public:
  /// The solid's law must be that of the model. `middle` (m): the center of the patch for press() and of the static
  /// modes; z is ignored. Throws std::invalid_argument if the model does not support the mesh or an effect.
  PressedBody(Kind kind, Solid solid, double patch_radius, const Vec3& middle, const Config& config);
  PressedBody(const PressedBody&) = delete;
  PressedBody& operator=(const PressedBody&) = delete;

  Feel touch(const Vec3& tool) { return contact_.at(tool); }
  Reaction press(Prescribed given, double value) { return model_->press(patch_, given, value); }
  Reaction settle(Prescribed given, double value) { return softbody::settle(*model_, patch_, given, value); }
  double step() const noexcept { return model_->step(); }
  Body::Size size() const;

 private:
  Solid solid_;
  TouchSurface surface_;
  std::unique_ptr<Model> model_;
  PatchContact contact_;
  Patch patch_;
};

}  // namespace tendon::softbody::compared
