// SPDX-License-Identifier: Apache-2.0
//
// preCICE itself between two processes of this machine.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <precice/precice.hpp>
#include <string>
#include <vector>

#include "clients/precice/precice_engine.h"

namespace tendon::precice_worker {
namespace {

constexpr double kStiffness = 500;  // N/m

/// A solver of nothing but springs, with a mesh of its own. Each node that holds is told to preCICE as its force.
void be_the_body(const std::string& file, const std::vector<double>& places) {
  precice::Participant participant("Body", file, 0, 1);
  std::vector<precice::VertexID> nodes(places.size() / 3);
  participant.setMeshVertices("Body-Mesh", places, nodes);
  participant.initialize();
  std::vector<double> values(places.size());
  while (participant.isCouplingOngoing()) {
    const double step = participant.getMaxTimeStepSize();
    participant.readData("Body-Mesh", "Displacement", nodes, step, values);
    for (double& value : values) value *= kStiffness / static_cast<double>(nodes.size());
    participant.writeData("Body-Mesh", "Force", nodes, values);
    participant.advance(step);
  }
}

/// The body's process; it is gone at the end.
class Body {
 public:
  Body(const std::string& file, const std::vector<double>& places) : pid_(::fork()) {
    if (pid_ != 0) return;
    try {
      be_the_body(file, places);
    } catch (const std::exception&) {
      ::_exit(1);  // its peer has gone
    }
    ::_exit(0);
  }
  ~Body() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

 private:
  pid_t pid_;
};

TEST(PreciceCoupling, EachForceAnswersTheStateOfItsOwnWindow) {
  const auto folder = std::filesystem::path(testing::TempDir()) / ("precice-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::filesystem::current_path(folder);  // where both look for each other's address
  const PreciceEngine::Config config{.file = TENDON_PRECICE_CONFIG};
  {
    const Body body(config.file, TouchedPatch(config.patch).places());
    PreciceEngine engine(config);
    for (int i = 1; i <= 50; ++i) {
      DeviceState hand;
      hand.position = Vec3(1e-4 * (i * 37 % 50), 0, 0);
      EXPECT_NEAR(engine.answer(hand).force.x(), -kStiffness * hand.position.x(), 1e-12) << i;
    }
  }
  std::filesystem::current_path(folder.parent_path());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tendon::precice_worker
