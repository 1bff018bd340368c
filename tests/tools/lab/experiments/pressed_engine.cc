// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/pressed_engine.h"

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <utility>
#include <variant>

#include "clients/softbody/scene.h"
#include "core/base/expect.h"
#include "tests/clients/softbody/mpi/live_worker.h"
#include "tests/server/scratch_folder.h"

namespace tendon::lab {
namespace {

using namespace softbody;

constexpr int kMostPresses = 10;  // Newton iterations per answer under a load
constexpr int kPatienceS = 600;
constexpr double kFirstDepth = 1e-4;  // m, for the first estimate of the stiffness

/// Repeats the press until Newton's method converges, which never happens for a collapsing body.
template <class AnyBody>
Reaction pressed(AnyBody& body, double load) {
  Reaction reaction;
  for (int i = 0; i < kMostPresses && !(i > 0 && reaction.error <= 1e-4 * load); ++i) {
    reaction = body.press(Prescribed::kForce, load);
  }
  return reaction;
}

class OwnEngine final : public PressedEngine {
 public:
  explicit OwnEngine(const BodyConfig& config) : learned_(learns(config)), body_(config) {}

  Feel touch(const Vec3& tool) override { return body_.touch(tool); }
  Reaction under(double load) override {
    if (body_.step() > 0) return body_.settle(Prescribed::kForce, load);
    return learned_ ? learned_under(load) : pressed(body_, load);
  }
  double step() const override { return body_.step(); }
  Body::Size size() const override { return body_.size(); }
  double took(const Meter::Reading& cost) const override { return cost.processor; }

 private:
  /// Learned models only answer depths, so the depth for the load is found by iteration.
  Reaction learned_under(double load) {
    Reaction reaction = body_.press(Prescribed::kDepth, kFirstDepth);
    for (int i = 0; i < kMostPresses && std::abs(reaction.force - load) > 1e-9 * load; ++i) {
      reaction = body_.press(Prescribed::kDepth, reaction.depth + (load - reaction.force) / reaction.stiffness);
    }
    return reaction;
  }

  bool learned_;
  Body body_;
};

class ComparedEngine final : public PressedEngine {
 public:
  ComparedEngine(compared::Kind kind, Solid solid, double patch_radius, const Vec3& middle,
                 const compared::Config& config)
      : kind_(kind), body_(kind, std::move(solid), patch_radius, middle, config) {}

  Feel touch(const Vec3& tool) override { return body_.touch(tool); }
  /// Models with time steps or a fixed number of iterations need several presses to come to rest.
  Reaction under(double load) override {
    const bool settles = body_.step() > 0 || kind_ == compared::Kind::kProjective;
    return settles ? body_.settle(Prescribed::kForce, load) : pressed(body_, load);
  }
  double step() const override { return body_.step(); }
  Body::Size size() const override { return body_.size(); }
  double took(const Meter::Reading& cost) const override { return cost.processor; }

 private:
  compared::Kind kind_;
  compared::PressedBody body_;
};

std::string in_mm(const Vec3& metres) {
  return "[" + shortest(1e3 * metres.x()) + ", " + shortest(1e3 * metres.y()) + ", " + shortest(1e3 * metres.z()) + "]";
}

std::string scene_of(const BodyConfig& config) {
  const auto& block = std::get<BlockShape>(config.shape);
  std::string text = "effects = [\"contact\"]\n[body]\nshape = \"block\"\nsize_mm = " + in_mm(block.size);
  text += "\ncells = [" + std::to_string(block.cells[0]) + ", " + std::to_string(block.cells[1]) + ", " +
          std::to_string(block.cells[2]) + "]\nelement = \"" + std::string(info(config.element).name) + "\"";
  text += "\nmaterial = { young_pa = " + shortest(config.material.young) +
          ", poisson = " + shortest(config.material.poisson) + " }";
  text += "\n[model]\nkind = \"linear\"\n[touch]\npatch_radius_mm = " + shortest(1e3 * config.patch_radius) +
          "\nmiddle_mm = " + in_mm(config.middle) + "\n";
  return text;
}

std::filesystem::path written(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
  return file;
}

class WorkerEngine final : public PressedEngine {
 public:
  WorkerEngine(const BodyConfig& block, const std::string& command)
      : file_(written(scratch_.path() / "scene.toml", scene_of(block))),
        scene_(read_scene(file_)),
        middle_(block.middle),
        size_(Body::size_of(scene_.body, under_patch_)),
        worker_(command + " " + file_.string(), kPatienceS) {}

  Feel touch(const Vec3& tool) override {
    const Mat3 frame = to_device(scene_);
    const Touch touch = worker_.answer(Vec3(scene_.at + frame * (tool - middle_)));
    Feel feel;
    feel.force = frame.transpose() * touch.force;
    feel.touching = !feel.force.isZero(0);
    if (touch.stiffness) feel.stiffness = frame.transpose() * *touch.stiffness * frame;
    feel.valid_radius = touch.valid_radius;
    feel.error = touch.error.value_or(0);
    return feel;
  }
  /// The body is linear, so the second press is at the load's depth.
  Reaction under(double load) override {
    double depth = kFirstDepth;
    Feel feel = touch(middle_ - Vec3(0, 0, depth));
    depth *= load / feel.force.z();
    feel = touch(middle_ - Vec3(0, 0, depth));
    Reaction reaction;
    reaction.force = feel.force.z();
    reaction.depth = depth;
    reaction.stiffness = feel.stiffness(2, 2);
    reaction.error = feel.error;
    return reaction;
  }
  double step() const override { return 0; }
  Body::Size size() const override { return size_; }
  double took(const Meter::Reading& cost) const override { return cost.wall; }

 private:
  tendon::testing::ScratchFolder scratch_;
  std::filesystem::path file_;
  Scene scene_;
  Vec3 middle_;  ///< m, of the patch at rest, body frame
  int under_patch_ = 0;
  Body::Size size_;
  LiveWorker worker_;
};

}  // namespace

std::unique_ptr<PressedEngine> own_engine(const BodyConfig& config) { return std::make_unique<OwnEngine>(config); }

std::unique_ptr<PressedEngine> compared_engine(compared::Kind kind, Solid solid, double patch_radius,
                                               const Vec3& middle, const compared::Config& config) {
  return std::make_unique<ComparedEngine>(kind, std::move(solid), patch_radius, middle, config);
}

std::unique_ptr<PressedEngine> worker_engine(const BodyConfig& block, const std::string& command) {
  return std::make_unique<WorkerEngine>(block, command);
}

}  // namespace tendon::lab
