// SPDX-License-Identifier: Apache-2.0
// law-cost: prints the name of each law, or `field` with --field. Callgrind counts inside `step_law` or `step_field`, and
// writes a file at each return from it.
#include <cmath>
#include <cstddef>
#include <iostream>
#include <memory>
#include <numbers>
#include <string_view>
#include <vector>

#include "core/control/preset.h"
#include "core/field/renderer.h"
#include "tests/support/plain_usage.h"
#include "tests/tools/lab/experiments/law_steps.h"
#include "tests/tools/lab/experiments/paper.h"

using namespace tendon;

/// Not inlined or mangled, so that callgrind finds the name.
extern "C" [[gnu::noinline]] void step_law(lab::LawSteps& law, int periods) {
  for (int period = 0; period < periods; ++period) {
    for (std::size_t i = 0; i < lab::LawSteps::kPeriod; ++i) law.step(i);
  }
}

/// 1 mm below the surface, with friction.
extern "C" [[gnu::noinline]] void step_field(field::Renderer& renderer, const std::vector<Motion>& hand, int periods) {
  for (int period = 0; period < periods; ++period) {
    for (std::size_t i = 0; i < hand.size(); ++i) renderer.render(hand[i], 1, i);
  }
}

namespace {

/// A proxy on a sphere of bricks.
void count_field() {
  field::BrickField bricks;
  field::sample([](const Vec3& x) { return x.norm() - 0.03; }, Vec3::Constant(-0.035), Vec3::Constant(0.035), 1e-3,
                bricks);
  const field::Field shape{.bricks = &bricks, .materials = {{.stiffness = 1000, .friction = 0.3}}};
  std::vector<Motion> hand(lab::LawSteps::kPeriod);
  for (std::size_t i = 0; i < hand.size(); ++i) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(hand.size());
    hand[i] = {.at = LocalTime(std::chrono::milliseconds(i)),
               .position = 0.029 * Vec3(std::cos(turn), std::sin(turn), 1).normalized()};
  }
  for (const int periods : {1, 2}) {
    const auto renderer = std::make_unique<field::Renderer>(field::Renderer::Config{});
    renderer->use(&shape, LocalTime{});
    step_field(*renderer, hand, periods);
  }
  std::cout << "field\n";
}

void count(const LimiterConfig& config, std::string_view name) {
  for (const int periods : {1, 2}) {
    lab::LawSteps steps(config);
    step_law(steps, periods);
  }
  std::cout << name << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  const PlainUsage usage{
      .help =
          "Usage: law-cost [--field]\n\n"
          "Run the steps of each law of the limiter, or those of a field, so that callgrind can count the\n"
          "instructions, and print their names.\n\n"
          "Example: tendon-lab golden --cost\n"
          "Exit: 0 success; 2 wrong usage.\n",
      .options = {"--field"}};
  if (const auto code = answer(usage, argc, argv)) return *code;
  if (argc > 1) {
    count_field();
    return 0;
  }
  for (const LawInfo& law : laws()) {
    LimiterConfig config = lab::measured_limiter(law.law);
    config.parts = lab::default_parts(lab::kPaperEncoder);
    count(config, law.name);
  }
  for (const PresetInfo& preset : presets()) {
    LimiterConfig config = lab::measured_limiter(Law::kAolPlus);
    config.parts = preset_parts(preset.preset, {.friction = config.friction,
                                                .longest_hold = config.longest_hold,
                                                .encoder_step = lab::kPaperEncoder})
                       .parts;
    count(config, preset.name);
  }
}
