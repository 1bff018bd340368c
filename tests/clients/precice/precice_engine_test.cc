// SPDX-License-Identifier: Apache-2.0
#include "clients/precice/precice_engine.h"

#include <gtest/gtest.h>

#include <precice/precice.hpp>
#include <stdexcept>

#include "tests/support/refusal.h"

namespace tendon::precice_worker::precice_engine_test {
namespace {

class PreciceEngineWithAPartner : public testing::Test {
 protected:
  PreciceEngineWithAPartner() { precice::partner = {}; }
  PreciceEngine::Config config{.file = "coupling.xml"};
};

DeviceState at(double x) {
  DeviceState hand;
  hand.position = Vec3(x, 0, 0);
  return hand;
}

TEST_F(PreciceEngineWithAPartner, EachAnswerIsOneWindowAndOfItsOwnState) {
  PreciceEngine engine(config);
  EXPECT_EQ(precice::partner.written_before_start, 0);
  for (int i = 1; i <= 20; ++i) {
    const double depth = 1e-4 * (i % 7);
    EXPECT_NEAR(engine.answer(at(depth)).force.x(), -500 * depth, 1e-12);
    EXPECT_EQ(precice::partner.advanced, i);
  }
}

TEST_F(PreciceEngineWithAPartner, InitialDataAreWrittenWhereTheyAreWanted) {
  precice::partner.wants_initial = true;
  PreciceEngine engine(config);
  EXPECT_EQ(precice::partner.written_before_start, 1);
}

TEST_F(PreciceEngineWithAPartner, TheEndOfTheCouplingIsAnErrorThatNamesTheFile) {
  precice::partner.windows = 2;
  PreciceEngine engine(config);
  engine.answer(at(0.001));
  engine.answer(at(0.002));
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { engine.answer(at(0.003)); }),
            "the coupling has ended because of max-time or max-time-windows in coupling.xml");
}

TEST_F(PreciceEngineWithAPartner, AMeshOfTwoDimensionsIsRefused) {
  precice::partner.dimensions = 2;
  EXPECT_THROW(PreciceEngine{config}, std::invalid_argument);
}

TEST_F(PreciceEngineWithAPartner, NamesAreThoseOfItsConfiguration) {
  for (const auto& name : {&PreciceEngine::Config::participant, &PreciceEngine::Config::mesh}) {
    PreciceEngine::Config other = config;
    other.*name = "Another";
    EXPECT_THROW(PreciceEngine{other}, std::runtime_error);
  }
  for (const auto& name : {&PreciceEngine::Config::displacement, &PreciceEngine::Config::force}) {
    PreciceEngine::Config other = config;
    other.*name = "Another";
    PreciceEngine engine(other);
    EXPECT_THROW(engine.answer(at(0.001)), std::runtime_error);
  }
}

}  // namespace
}  // namespace tendon::precice_worker::precice_engine_test
