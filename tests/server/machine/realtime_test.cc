// SPDX-License-Identifier: Apache-2.0
#include "server/machine/realtime.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "tests/server/scratch_folder.h"

namespace tendon::realtime_test {
namespace {

using testing::ScratchFolder;

cpu_set_t allowed() {
  cpu_set_t set;
  CPU_ZERO(&set);
  pthread_getaffinity_np(pthread_self(), sizeof set, &set);
  return set;
}

std::uint32_t last_of(const cpu_set_t& set) {
  std::uint32_t last = 0;
  for (std::uint32_t cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &set)) last = cpu;
  }
  return last;
}

TEST(SmallStacks, AreThoseOfThreadsThatBeginAfterwards) {
  use_small_stacks();
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "what the thread sanitizer has for each thread is larger";
#endif
  std::thread([] {
    pthread_attr_t attributes;
    ASSERT_EQ(pthread_getattr_np(pthread_self(), &attributes), 0);
    std::size_t bytes = 0;
    pthread_attr_getstacksize(&attributes, &bytes);
    pthread_attr_destroy(&attributes);
    EXPECT_EQ(bytes, 256U * 1024);
  }).join();
}

TEST(StayOn, KeepsTheThreadThatAsksOnThatProcessorAndNoOther) {
  const cpu_set_t before = allowed();
  const std::uint32_t cpu = last_of(before);
  std::thread([cpu] {
    EXPECT_FALSE(stay_on(cpu));
    const cpu_set_t now = allowed();
    EXPECT_EQ(CPU_COUNT(&now), 1);
    EXPECT_TRUE(CPU_ISSET(cpu, &now));
    EXPECT_EQ(sched_getcpu(), static_cast<int>(cpu));
  }).join();
  const cpu_set_t after = allowed();
  EXPECT_TRUE(CPU_EQUAL(&before, &after)) << "of the thread only";
}

TEST(StayOn, SaysWhatToDoAboutAProcessorThatIsNotThereAndChangesNothing) {
  for (const std::uint32_t cpu : {1023U, 1024U, 4'000'000'000U}) {
    std::thread([cpu] {
      const cpu_set_t before = allowed();
      if (CPU_ISSET(1023, &before)) return;  // the machine has this CPU
      const auto refused = stay_on(cpu);
      ASSERT_TRUE(refused);
      EXPECT_NE(refused->find("processor " + std::to_string(cpu)), std::string::npos) << *refused;
      EXPECT_NE(refused->find("`nproc --all`"), std::string::npos) << *refused;
      const cpu_set_t after = allowed();
      EXPECT_TRUE(CPU_EQUAL(&before, &after));
    }).join();
  }
}

TEST(WakefulProcessors, AskForNoLatencyIn32BitsAndHoldTheFileOpen) {
  const ScratchFolder folder;
  const auto file = folder.path() / "cpu_dma_latency";
  std::ofstream(file) << "????";
  const auto open_files = [&file] {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
      std::error_code gone;
      if (std::filesystem::read_symlink(entry, gone) == file) ++count;
    }
    return count;
  };
  {
    const WakefulProcessors wakeful(file);
    EXPECT_TRUE(wakeful.held());
    EXPECT_FALSE(wakeful.refused());
    EXPECT_EQ(open_files(), 1) << "the kernel holds to it for as long as the file is open";
  }
  EXPECT_EQ(open_files(), 0);
  std::ifstream stream(file);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), std::string(4, '\0'));
}

TEST(WakefulProcessors, AreNoRefusalWhereTheKernelHasNoSuchFile) {
  const ScratchFolder folder;
  const WakefulProcessors wakeful(folder.path() / "none");
  EXPECT_FALSE(wakeful.held());
  EXPECT_FALSE(wakeful.refused());
}

TEST(WakefulProcessors, SayWhatItWouldTakeWhenRefused) {
  const ScratchFolder folder;  // opening a folder for writing fails even for root
  const WakefulProcessors wakeful(folder.path());
  EXPECT_FALSE(wakeful.held());
  ASSERT_TRUE(wakeful.refused());
  EXPECT_NE(wakeful.refused()->find("Allow it with a udev rule"), std::string::npos) << *wakeful.refused();
}

}  // namespace
}  // namespace tendon::realtime_test
