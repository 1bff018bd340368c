// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "clients/precice/precice_engine.h"

namespace tendon::precice_worker::precice_coupling_test {
namespace {

/// The total stiffness in spring_body_main.cc, N/m.
constexpr double kStiffness = 500;

class Body {
 public:
  explicit Body(const std::string& file) : pid_(::fork()) {
    if (pid_ != 0) return;
    ::execl(TENDON_SPRING_BODY, TENDON_SPRING_BODY, file.c_str(), nullptr);
    ::_exit(127);
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
  std::filesystem::current_path(folder);  // where preCICE exchanges addresses
  const PreciceEngine::Config config{.file = TENDON_PRECICE_CONFIG};
  {
    const Body body(config.file);
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
}  // namespace tendon::precice_worker::precice_coupling_test
