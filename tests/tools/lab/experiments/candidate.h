// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/solid.h"
#include "tests/tools/lab/experiments/pressed_block.h"
#include "tests/tools/lab/experiments/pressed_engine.h"
#include "tests/tools/lab/models/compared.h"

namespace tendon::lab {

using AnyModel = std::variant<softbody::ModelKind, softbody::compared::Kind>;

std::vector<AnyModel> all_models();
std::string names_of_models();  ///< "linear|condensed|…"
std::optional<AnyModel> any_model_named(std::string_view name);

std::string_view name_of(const AnyModel& model);
/// Returns true for comparison models, which the figures show as dashed lines and which are never recommended.
bool for_comparison(const AnyModel& model);
bool wants_tetrahedra(const AnyModel& model);
/// Returns the material law of a model; for `near` that of the truth.
softbody::Law law_of(const AnyModel& model);

/// A model on a mesh with `n` cells along x and cells of about the same size along y and z.
struct Candidate {
  /// The model, the learned shapes or the table of a `near` body, or AccuracyOptions::worker.
  enum class By : std::uint8_t { kModel, kLearned, kTable, kWorker };

  AnyModel model;
  softbody::Element element;
  int n;
  By by = By::kModel;

  bool elsewhere() const noexcept { return by == By::kWorker; }
  std::string way() const;   ///< "linear", "near-learned", "near-table", "worker"
  std::string name() const;  ///< way and element: "linear-hex8-sri"
};

/// Fixed at the bottom. Material and law may differ from those of block and model.
softbody::Solid solid_of(const PressedBlock& block, const Candidate& candidate, softbody::Law law,
                         const softbody::Material& material);

/// `worker`: command of the external process, if used. Throws the model's exception if it does not support the mesh.
std::unique_ptr<PressedEngine> engine_of(const PressedBlock& block, const Candidate& candidate,
                                         const std::string& worker);

}  // namespace tendon::lab
