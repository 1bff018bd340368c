// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/identify.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/support/dice.h"
#include "tests/tools/lab/identify/simulated_ramps.h"

namespace tendon::lab::identify_test {
namespace {

class Identify : public ::testing::Test {
 protected:
  struct Mistake {
    double time = 1, position = 1, force = 1;
  };

  /// b = 0.005 N·s/m and f_c = 0.05 N.
  std::vector<std::filesystem::path> recorded_runs() { return recorded_runs(Mistake()); }
  std::vector<std::filesystem::path> recorded_runs(const Mistake& by) {
    RampExperiment experiment;
    experiment.device.mass = 0.075;
    experiment.device.viscous_friction = 0.005;
    experiment.device.coulomb_friction = 0.05;
    experiment.device.encoder_step = 3e-5;
    experiment.repeats = 2;
    return written(experiment, "t_s,x_m,force_n", by);
  }
  std::vector<std::filesystem::path> written(const RampExperiment& experiment, const char* columns, const Mistake& by) {
    std::vector<std::filesystem::path> files;
    for (const RampRun& run : simulated_ramps(experiment)) {
      files.push_back(folder_.path() / (std::to_string(files.size()) + ".csv"));
      std::ofstream file(files.back());
      file.precision(12);
      file << columns << '\n';
      for (const RampSample& sample : run.samples) {
        file << by.time * sample.t << ',' << by.position * sample.position << ',' << by.force * sample.force << '\n';
      }
    }
    return files;
  }
  std::string output_of(const IdentifyOptions& options) {
    std::ostringstream out;
    identify(options, out);
    return out.str();
  }

  std::string error_of(const IdentifyOptions& options) {
    std::ostringstream out;
    try {
      identify(options, out);
    } catch (const std::exception& error) {
      EXPECT_EQ(out.str(), "");
      return error.what();
    }
    return "no error";
  }

  tendon::testing::ScratchFolder folder_;
};

double value_after(const std::string& text, const std::string& key) {
  const auto at = text.find(key);
  if (at == std::string::npos) throw std::runtime_error("no " + key + " in " + text);
  return std::stod(text.substr(at + key.size()));
}

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(Identify, EndsWithAFragmentOfAScene) {
  const std::string text = output_of({.simulated_friction = Friction{.coulomb = 0.05, .viscous = 0.005}});
  const auto fragment = text.find("\n[limiter]\n");
  ASSERT_NE(fragment, std::string::npos) << text;
  EXPECT_NEAR(value_after(text.substr(fragment), "coulomb_friction_n = "), 0.0497, 0.0003);
  EXPECT_NEAR(value_after(text.substr(fragment), "viscous_friction_n_s_per_m = "), 0.0042, 0.0008);
  EXPECT_TRUE(holds(text, "Valid: integral. Kelly's fit is not valid at x: the slide of")) << text;
}

TEST_F(Identify, TrustsBothOnMuchFriction) {
  const std::string text = output_of({.simulated_friction = Friction{.coulomb = 0.05, .viscous = 0.26}});
  EXPECT_TRUE(holds(text, "Valid: both.")) << text;
}

TEST_F(Identify, ReadsRecordedRunsAndGivesOneObjectForEachAndOneForTheResult) {
  const auto files = recorded_runs();
  const std::string text = output_of({.files = files, .mass = 0.075, .json = true});
  std::istringstream lines(text);
  std::size_t runs = 0;
  std::string line;
  std::string last;
  for (; std::getline(lines, line); last = line) {
    EXPECT_EQ(line.front(), '{');
    EXPECT_EQ(line.back(), '}');
    if (line.starts_with("{\"run\":")) ++runs;
  }
  EXPECT_EQ(runs, files.size());
  ASSERT_TRUE(last.starts_with("{\"result\":\"integral\"")) << last;
  EXPECT_NEAR(value_after(last, "\"estimate_viscous_n_s_per_m\":"), 0.005, 0.0015);
  EXPECT_NEAR(value_after(last, "\"estimate_coulomb_n\":"), 0.05, 0.001);
  EXPECT_LT(value_after(last, "\"lower_bound_viscous_n_s_per_m\":"), 0.005);
}

TEST_F(Identify, KeepsPlacesApart) {
  const auto files = recorded_runs();
  std::vector<std::string> places(files.size(), "x, arm \"bent\"");
  places.back() = "y";
  const std::string text = output_of({.files = files, .places = places, .mass = 0.075, .json = true});
  EXPECT_TRUE(holds(text, "\"place\":\"x, arm \\\"bent\\\"\"")) << text;
  EXPECT_TRUE(holds(text, "only one direction at y")) << text;
}

TEST_F(Identify, SimulatesEveryProfile) {
  for (const std::string profile : {"phantom-premium", "touch", "falcon"}) {
    EXPECT_TRUE(holds(output_of({.profile = profile}), "\n[limiter]\n")) << profile;
  }
}

TEST_F(Identify, TheBoundsOfARotationAndAGripperAreBelowTheTruthAndNearIt) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Dice dice(seed);
    const bool turns = seed % 2 == 0;
    const Friction truth = turns ? Friction{.coulomb = dice.decades(-3.3, -2.7), .viscous = dice.decades(-4, -3)}
                                 : Friction{.coulomb = dice.decades(-1.6, -1), .viscous = dice.decades(-1.3, -0.3)};
    const std::string text = output_of(
        {.freedom = turns ? Freedom::kRotation : Freedom::kGripper, .simulated_friction = truth, .seed = seed});
    const auto fragment = text.find(turns ? "\n[limiter.rotation]\n" : "\n[limiter.gripper]\n");
    ASSERT_NE(fragment, std::string::npos) << text;
    const std::string scene = text.substr(fragment);
    const double coulomb = value_after(scene, turns ? "coulomb_friction_nm = " : "coulomb_friction_n = ");
    const double viscous =
        value_after(scene, turns ? "viscous_friction_nm_s_per_rad = " : "viscous_friction_n_s_per_m = ");
    const double most = turns ? 0.985 : 1;
    EXPECT_LE(coulomb, most * truth.coulomb) << text;
    EXPECT_LE(viscous, most * truth.viscous) << text;
    EXPECT_GE(coulomb, 0.85 * truth.coulomb) << text;
    EXPECT_GE(viscous, 0.7 * truth.viscous) << text;
  }
}

TEST_F(Identify, ReadsTheColumnsOfARotation) {
  const auto file = folder_.path() / "turn.csv";
  std::ofstream(file) << "t_s,x_m,force_n\n0,0,0\n";
  EXPECT_EQ(error_of({.files = {file}, .freedom = Freedom::kRotation}),
            file.string() + ":1: expected a header line with a column 'angle_rad', found 't_s,x_m,force_n'");
  RampExperiment experiment{.freedom = Freedom::kRotation, .rates = {0.001, 0.002, 0.01}, .repeats = 1, .travel = 2};
  experiment.device.mass = 0.1;
  experiment.device.rotation = SimulatedRotation::Config{
      .inertia = 1e-4, .viscous_friction = 5e-4, .coulomb_friction = 1e-3, .max_torque = 1, .encoder_step = 1e-4};
  experiment.force_noise = 1e-4;
  const auto files = written(experiment, "t_s,angle_rad,torque_nm", Mistake());
  const std::string text = output_of({.files = files, .freedom = Freedom::kRotation, .mass = 1e-4, .json = true});
  EXPECT_NEAR(value_after(text, "\"estimate_viscous_nm_s_per_rad\":"), 5e-4, 5e-5) << text;
  EXPECT_NEAR(value_after(text, "\"estimate_coulomb_nm\":"), 1e-3, 5e-5) << text;
}

TEST_F(Identify, NamesTheFileAndTheLineThatIsBad) {
  auto files = recorded_runs();
  {
    std::ofstream file(files[3]);
    file << "t_s,x_m,force_n\n0,0,0\n0.001,oops,0\n";
  }
  EXPECT_EQ(error_of({.files = files}), files[3].string() + ":3: expected a finite number as x_m, found 'oops'");
}

// Regression: with times in ms, a friction 1000 times too large was trusted.
TEST_F(Identify, RefusesWhatNoHandleHasAndNamesTheUnitThatWasMeant) {
  const auto ms = recorded_runs({.time = 1000});
  EXPECT_EQ(error_of({.files = ms}),
            ms[0].string() + ": the samples are 1 s apart, expected at most 0.05 s; are the times in ms?");
  const std::string mm = error_of({.files = recorded_runs({.position = 1000})});
  EXPECT_TRUE(holds(mm, "0.csv: the travel is ")) << mm;
  EXPECT_TRUE(holds(mm, " m, expected at most 3 m for a handle; are the positions in mm?")) << mm;
  const std::string mn = error_of({.files = recorded_runs({.force = 1000})});
  EXPECT_TRUE(holds(mn, "the runs fit an inertia of 7")) << mn;
  EXPECT_TRUE(holds(
      mn, "kg, expected 0.001 to 20 kg, which is the range of handles; are the times in ms, or the efforts in mN?"))
      << mn;
  const auto runs = recorded_runs();
  EXPECT_EQ(error_of({.files = runs, .mass = 75}),
            "--mass 75: expected 0.001 to 20 kg, which is the range of handles; is it in g?");
  EXPECT_EQ(error_of({.files = runs, .encoder_step = 30}), "--encoder-step 30: expected at most 0.001 m; is it in µm?");
}

TEST_F(Identify, GivesNoBoundsWhereNothingIsTrusted) {
  IdentifyOptions options{.simulated_friction = Friction{.coulomb = 0.05, .viscous = 0.26}, .mass = 0.0375};
  const std::string text = output_of(options);
  EXPECT_TRUE(holds(text, "Valid: neither.")) << text;
  EXPECT_FALSE(holds(text, "ower bound")) << text;
  options.json = true;
  EXPECT_FALSE(holds(output_of(options), "lower_bound"));
}

TEST_F(Identify, NamesTheFileWhoseRunCannotBeUsed) {
  auto files = recorded_runs();
  {
    std::ofstream file(files[3]);
    file << "t_s,x_m,force_n\n0,0,0\n0.001,0,0\n";
  }
  EXPECT_EQ(error_of({.files = files}), files[3].string() + ": expected a run of 50 samples or more, found 2");
  EXPECT_TRUE(holds(error_of({.files = {folder_.path() / "none.csv"}}), "cannot read ramp run"));
}

TEST_F(Identify, RefusesOptionsThatMakeNoSense) {
  EXPECT_TRUE(holds(error_of({}), "expected a CSV file"));
  EXPECT_TRUE(holds(error_of({.files = {"a.csv"}, .profile = "touch"}), "found several"));
  EXPECT_TRUE(holds(error_of({.files = {"a.csv"}, .places = {"x", "y"}}), "--axis once for each of 1 files, found 2"));
  EXPECT_EQ(error_of({.profile = "tuch"}),
            "--simulate tuch: expected one of phantom-premium, touch, falcon; did you mean touch?");
  EXPECT_TRUE(holds(error_of({.profile = "touch", .mass = -1}), "--mass -1"));
  EXPECT_TRUE(holds(error_of({.profile = "touch", .encoder_step = 0}), "--encoder-step 0"));
  EXPECT_TRUE(holds(error_of({.simulated_friction = Friction{.coulomb = -1, .viscous = 0.1}}), "coulomb_friction"));
}

}  // namespace
}  // namespace tendon::lab::identify_test
