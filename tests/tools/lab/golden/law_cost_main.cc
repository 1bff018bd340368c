// SPDX-License-Identifier: Apache-2.0
// law-cost: prints each law's name. Callgrind counts inside `step_law` and writes a file at each return from it.
#include <cstddef>
#include <iostream>
#include <string_view>

#include "core/control/preset.h"
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

namespace {

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
          "Usage: law-cost\n\n"
          "Run the steps of each law of the limiter, so that callgrind can count the instructions, and print\n"
          "the names of the laws.\n\n"
          "Example: tendon-lab golden --cost\n"
          "Exit: 0 success; 2 wrong usage.\n"};
  if (const auto code = answer(usage, argc, argv)) return *code;
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
