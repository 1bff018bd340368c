// SPDX-License-Identifier: Apache-2.0
// Calls libhdPhantom.so in the same way as CHAI3D (cPhantomDevice, cHapticDeviceHandler). It loads both libraries by
// name with RTLD_GLOBAL and looks up 14 symbols. It reads the number of devices. For each device, it reads the number
// again and the radius and type, and opens the device. It then reads the handle and sets the force in a loop without
// sleeping, and finally calls Close and StopServo.
//
// chai3d_program [--seconds S] [--wall N_PER_M] [--push X Y Z] [--twist X Y Z] [--second-process]
//
// The wall is at y > 0 in CHAI3D's frame. Prints one JSON object per line.
#include <dlfcn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace {

// NOLINTBEGIN(readability-identifier-naming): the names are CHAI3D's
int (*GetNumDevices)();
int (*Open)(int);
int (*Close)(int);
int (*GetPosition)(int, double*, double*, double*);
int (*GetLinearVelocity)(int, double*, double*, double*);
int (*GetRotation)(int, double*, double*, double*, double*, double*, double*, double*, double*, double*);
int (*GetButtons)(int);
int (*SetForce)(int, const double*, const double*, const double*);
int (*SetTorque)(int, const double*, const double*, const double*);
int (*SetForceAndTorque)(int, const double*, const double*, const double*, const double*, const double*, const double*);
int (*GetWorkspaceRadius)(int, double*);
int (*GetType)(int, char*);
void (*StartServo)();
void (*StopServo)();
// NOLINTEND(readability-identifier-naming)

// NOLINTBEGIN(concurrency-mt-unsafe): this program has one thread
template <typename Function>
void load(void* library, Function& function, const char* name) {
  void* const symbol = dlsym(library, name);
  if (symbol == nullptr) {
    std::fprintf(stderr, "%s\n", dlerror());
    std::exit(3);
  }
  std::memcpy(&function, &symbol, sizeof symbol);
}

void load_libraries() {
  if (dlopen("libHD.so", RTLD_LAZY | RTLD_GLOBAL) == nullptr) std::exit(2);
  void* const library = dlopen("libhdPhantom.so", RTLD_LAZY | RTLD_GLOBAL);
  if (library == nullptr) std::exit(2);
  load(library, GetNumDevices, "hdPhantomGetNumDevices");
  load(library, Open, "hdPhantomOpen");
  load(library, Close, "hdPhantomClose");
  load(library, GetPosition, "hdPhantomGetPosition");
  load(library, GetLinearVelocity, "hdPhantomGetLinearVelocity");
  load(library, GetRotation, "hdPhantomGetRotation");
  load(library, GetButtons, "hdPhantomGetButtons");
  load(library, SetForce, "hdPhantomSetForce");
  load(library, SetTorque, "hdPhantomSetTorque");
  load(library, SetForceAndTorque, "hdPhantomSetForceAndTorque");
  load(library, GetWorkspaceRadius, "hdPhantomGetWorkspaceRadius");
  load(library, GetType, "hdPhantomGetType");
  load(library, StartServo, "hdPhantomStartServo");
  load(library, StopServo, "hdPhantomStopServo");
}
// NOLINTEND(concurrency-mt-unsafe)

using Vec = std::array<double, 3>;
using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

long threads() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/task"), std::filesystem::directory_iterator());
}

struct Arguments {
  double seconds = 1;
  double wall = 0;
  Vec push{};
  Vec twist{};
  bool second_process = false;
};

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const auto number = [&] { return std::atof(argv[++i]); };
    if (name == "--seconds") arguments.seconds = number();
    if (name == "--wall") arguments.wall = number();
    if (name == "--push") arguments.push = {number(), number(), number()};
    if (name == "--twist") arguments.twist = {number(), number(), number()};
    if (name == "--second-process") arguments.second_process = true;
  }
  return arguments;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const Clock::time_point begun = Clock::now();
  load_libraries();
  const int count = GetNumDevices();
  std::printf("{\"event\":\"devices\",\"pid\":%d,\"count\":%d,\"took_s\":%.3f}\n", getpid(), count, since(begun));
  for (int id = 0; id < count; ++id) {
    GetNumDevices();
    double radius = -1;
    GetWorkspaceRadius(id, &radius);
    std::array<char, 255> type{};
    GetType(id, type.data());
    Open(id);
    std::printf("{\"event\":\"open\",\"device\":%d,\"radius\":%.4f,\"type\":\"%s\"}\n", id, radius, type.data());
  }
  if (count == 0) return 4;
  if (arguments.second_process) {
    const pid_t second = fork();
    if (second == 0) {
      const double zero = 0;
      std::printf("{\"event\":\"second\",\"open\":%d,\"force\":%d}\n", Open(0), SetForce(0, &zero, &zero, &zero));
      std::fflush(stdout);
      _exit(0);
    }
    waitpid(second, nullptr, 0);
  }

  long turns = 0;
  long failed = 0;
  long moved = 0;
  double deepest = 0;
  std::vector<Vec> last(static_cast<std::size_t>(count));
  std::vector<double> getters;
  double next_line = 0;
  const Clock::time_point start = Clock::now();
  while (since(start) < arguments.seconds) {
    for (int id = 0; id < count; ++id) {
      Vec p{};
      Vec v{};
      std::array<double, 9> r{};
      const Clock::time_point before = Clock::now();
      bool fine = GetPosition(id, &p[0], &p[1], &p[2]) != 0;
      getters.push_back(since(before));
      fine = GetLinearVelocity(id, &v[0], &v[1], &v[2]) != 0 && fine;
      fine = GetRotation(id, &r[0], &r[1], &r[2], &r[3], &r[4], &r[5], &r[6], &r[7], &r[8]) != 0 && fine;
      const int buttons = GetButtons(id);
      Vec force = arguments.push;
      if (p[1] > 0) force[1] -= arguments.wall * p[1];
      const Vec& torque = arguments.twist;
      fine = SetForceAndTorque(id, &force[0], &force[1], &force[2], &torque[0], &torque[1], &torque[2]) != -1 && fine;
      failed += fine ? 0 : 1;
      moved += p == last[static_cast<std::size_t>(id)] ? 0 : 1;
      last[static_cast<std::size_t>(id)] = p;
      deepest = std::max(deepest, p[1]);
      if (since(start) >= next_line) {
        std::printf(
            "{\"device\":%d,\"position\":[%.6f,%.6f,%.6f],\"velocity\":[%.6f,%.6f,%.6f],\"rotation\":["
            "%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f],\"buttons\":%d,\"fine\":%s}\n",
            id, p[0], p[1], p[2], v[0], v[1], v[2], r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], buttons,
            fine ? "true" : "false");
      }
    }
    if (since(start) >= next_line) next_line += 0.02;
    ++turns;
  }
  const double took = since(start);
  for (int id = 0; id < count; ++id) {
    Close(id);
    StopServo();
  }
  std::sort(getters.begin(), getters.end());
  std::printf(
      "{\"event\":\"end\",\"turns\":%ld,\"failed\":%ld,\"moved\":%ld,\"took_s\":%.4f,\"deepest_mm\":%.3f,"
      "\"getter_p50_us\":%.3f,\"getter_p99_us\":%.3f,\"threads\":%ld}\n",
      turns, failed, moved, took, 1e3 * deepest, 1e6 * getters[getters.size() / 2],
      1e6 * getters[getters.size() * 99 / 100], threads());
  return 0;
}
