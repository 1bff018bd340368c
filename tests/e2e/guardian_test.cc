// SPDX-License-Identifier: Apache-2.0
// A driver process sends forces to a socket and is killed. In this program, ioctl() writes the endpoint and the bytes
// to the socket instead of usbfs.
#include "devices/safety/guardian.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/ioctl.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdarg>
#include <cstring>
#include <iostream>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "devices/falcon/falcon_device.h"
#include "tests/devices/falcon/socket_cable.h"

namespace {
int busy_times = 0;  ///< number of transfers that the device refuses
}

extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list rest;
  va_start(rest, request);
  void* argument = va_arg(rest, void*);
  va_end(rest);
  if (request != USBDEVFS_BULK) return static_cast<int>(syscall(SYS_ioctl, fd, request, argument));
  if (busy_times > 0) {
    --busy_times;
    errno = ETIMEDOUT;
    return -1;
  }
  const auto* transfer = static_cast<const usbdevfs_bulktransfer*>(argument);
  std::array<char, 65> bytes{static_cast<char>(transfer->ep)};
  std::memcpy(bytes.data() + 1, transfer->data, transfer->len);
  return write(fd, bytes.data(), transfer->len + 1) < 0 ? -1 : static_cast<int>(transfer->len);
}

namespace tendon::guardian_test {
namespace {

using Clock = std::chrono::steady_clock;

const std::string kForce = "<BAAAAAAAAAAAAA>";
const std::string kZero = "<AAAAAAAAAAAAAA>";

ZeroPacket written(const std::string& bytes) { return ZeroPacket::written(std::as_bytes(std::span(bytes))); }
ZeroPacket usb(const std::string& bytes) { return ZeroPacket::usb(2, std::as_bytes(std::span(bytes))); }

class Heard {
 public:
  Heard() {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends.data()) != 0) throw std::runtime_error("no socket");
    near_ = ends[0];
    far_ = ends[1];
  }
  ~Heard() {
    close(near_);
    unplug();
  }
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;

  int end_of_the_driver() const { return far_; }
  int end_of_the_device() const { return near_; }
  void unplug() {
    if (far_ >= 0) close(far_);
    far_ = -1;
  }
  std::string next() {
    std::array<char, 128> bytes{};
    const ssize_t size = read(near_, bytes.data(), bytes.size());
    return size > 0 ? std::string(bytes.data(), static_cast<std::size_t>(size)) : "";
  }
  std::string last(const std::string& heard = "") {
    std::string last = heard;
    for (std::string packet = next(); !packet.empty(); packet = next()) last = packet;
    return last;
  }

 private:
  int near_ = -1;
  int far_ = -1;
};

/// Forks a process that runs `drive`, which must create the guardian.
template <class Drive>
pid_t driver(const Drive& drive) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  drive();
  _exit(0);
}

[[noreturn]] void stream(int fd) {
  for (;;) {
    if (write(fd, kForce.data(), kForce.size()) < 0) _exit(1);
    usleep(200);
  }
}

int ended_by(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

TEST(Guardian, WritesTheZeroPacketWhenTheDriverIsKilledHoweverItDies) {
  for (const int signal : {SIGKILL, SIGSEGV, SIGABRT, SIGBUS}) {
    SCOPED_TRACE(strsignal(signal));
    Heard device;
    const pid_t pid = driver([&] {
      std::signal(signal, SIG_DFL);  // with a sanitizer, the handler would turn the signal into a normal exit
      Guardian guardian;
      guardian.guard(0, device.end_of_the_driver(), written(kZero));
      stream(device.end_of_the_driver());
    });
    device.unplug();  // this process's copy
    for (int i = 0; i < 10; ++i) ASSERT_EQ(device.next(), kForce);
    kill(pid, signal);
    EXPECT_EQ(device.last(), kZero);
    EXPECT_EQ(ended_by(pid), signal);
  }
}

TEST(Guardian, WithoutOneTheDevicesLastWordIsTheForce) {
  Heard device;
  const pid_t pid = driver([&] { stream(device.end_of_the_driver()); });
  device.unplug();
  const std::string heard = device.next();
  kill(pid, SIGKILL);
  EXPECT_EQ(device.last(heard), kForce);
  ended_by(pid);
}

TEST(Guardian, WritesToAnEndpointOfUsbfs) {
  Heard device;
  const pid_t pid = driver([&] {
    busy_times = 2;
    Guardian guardian;
    guardian.guard(0, device.end_of_the_driver(), usb(kZero));
    stream(device.end_of_the_driver());
  });
  device.unplug();
  ASSERT_EQ(device.next(), kForce);
  kill(pid, SIGKILL);
  EXPECT_EQ(device.last(), "\x02" + kZero) << "endpoint 2, at the third try";
  ended_by(pid);
}

TEST(Guardian, OutlivesWhatEndsTheDriversProcessGroup) {
  Heard device;
  const pid_t pid = driver([&] {
    setpgid(0, 0);
    Guardian guardian;
    guardian.guard(0, device.end_of_the_driver(), written(kZero));
    stream(device.end_of_the_driver());
  });
  device.unplug();
  for (int i = 0; i < 10; ++i) ASSERT_EQ(device.next(), kForce);
  kill(-pid, SIGKILL);
  EXPECT_EQ(device.last(), kZero);
  ended_by(pid);
}

// If a process is under load, it can take tens of milliseconds to free its memory before it closes its files. This
// takes longer here if another process holds the same files.
TEST(Guardian, WritesZeroWhenItsParentDiesAndAgainWhenTheFilesClose) {
  Heard device;
  std::array<int, 2> lingering{};
  ASSERT_EQ(pipe(lingering.data()), 0);
  const pid_t pid = driver([&] {
    Guardian guardian;
    guardian.guard(0, device.end_of_the_driver(), written(kZero));
    const pid_t keeper = fork();
    if (keeper == 0) {
      for (;;) pause();
    }
    if (write(lingering[1], &keeper, sizeof keeper) != sizeof keeper) _exit(1);
    stream(device.end_of_the_driver());
  });
  device.unplug();
  pid_t keeper = 0;
  ASSERT_EQ(read(lingering[0], &keeper, sizeof keeper), static_cast<ssize_t>(sizeof keeper));
  for (const int end : lingering) close(end);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(device.next(), kForce);
  kill(pid, SIGKILL);
  EXPECT_EQ(ended_by(pid), SIGKILL);
  std::string heard = kForce;
  pollfd packet{.fd = device.end_of_the_device(), .events = POLLIN, .revents = 0};
  while (heard == kForce && poll(&packet, 1, 30'000) == 1) heard = device.next();
  EXPECT_EQ(heard, kZero) << "while the files are open";
  kill(keeper, SIGKILL);
  EXPECT_EQ(device.last(), kZero) << "when they are not";
}

[[noreturn]] void step_and_hang(Guardian& guardian, int fd, int steps, bool holds_force) {
  for (int i = 0; i < steps; ++i) {
    if (write(fd, kForce.data(), kForce.size()) < 0) _exit(1);
    guardian.heartbeat(0).beat(holds_force);
    usleep(1000);
  }
  for (;;) pause();
}

/// Returns all packets except for forces. It stops if there is no packet for `ms` milliseconds.
std::vector<std::string> heard_within(Heard& device, int ms) {
  std::vector<std::string> heard;
  pollfd packet{.fd = device.end_of_the_device(), .events = POLLIN, .revents = 0};
  while (poll(&packet, 1, ms) == 1) {
    if (const std::string next = device.next(); next != kForce) heard.push_back(next);
  }
  return heard;
}

TEST(Guardian, EndsTheForceOfADriverThatLivesAndTakesNoStepAndOnceMore) {
  Heard device;
  const pid_t pid = driver([&] {
    Guardian guardian;
    guardian.guard(0, device.end_of_the_driver(), written(kZero));
    step_and_hang(guardian, device.end_of_the_driver(), 50, true);
  });
  EXPECT_EQ(heard_within(device, 300), std::vector(2, kZero));
  kill(pid, SIGKILL);
  ended_by(pid);
}

TEST(Guardian, SaysWhenItDoesNotStand) {
  Guardian guardian;
  const auto becomes = [&guardian](bool stands) {
    for (int ms = 0; ms < 5000 && guardian.stands() != stands; ++ms) usleep(1000);
    return guardian.stands() == stands;
  };
  EXPECT_TRUE(guardian.stands());
  kill(guardian.pid(), SIGSTOP);
  EXPECT_TRUE(becomes(false)) << "stopped";
  kill(guardian.pid(), SIGCONT);
  EXPECT_TRUE(becomes(true)) << "continued";
  kill(guardian.pid(), SIGKILL);
  EXPECT_TRUE(becomes(false)) << "killed";
}

TEST(Guardian, WritesNothingWhileThereIsNoForceOrStepsCome) {
  Heard device;
  const pid_t pid = driver([&] {
    Guardian guardian;
    guardian.guard(0, device.end_of_the_driver(), written(kZero));
    step_and_hang(guardian, device.end_of_the_driver(), 50, false);
  });
  EXPECT_EQ(heard_within(device, 300), std::vector<std::string>());
  kill(pid, SIGKILL);
  ended_by(pid);
}

// The time is not checked, because virtual machines pause.
TEST(Guardian, SaysHowLongTheForceOutlivesADriverThatIsStopped) {
  std::vector<double> ms;
  for (int i = 0; i < 20; ++i) {
    Heard device;
    const pid_t pid = driver([&] {
      Guardian guardian;
      guardian.guard(0, device.end_of_the_driver(), written(kZero));
      step_and_hang(guardian, device.end_of_the_driver(), 1'000'000, true);
    });
    for (int packet = 0; packet < 20; ++packet) device.next();
    const auto stopped = Clock::now();
    kill(pid, SIGSTOP);
    std::string heard = device.next();
    while (heard == kForce) heard = device.next();
    ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - stopped).count());
    EXPECT_EQ(heard, kZero);
    kill(pid, SIGKILL);
    ended_by(pid);
  }
  std::sort(ms.begin(), ms.end());
  std::cout << "SIGSTOP of the driver to zero at the device: p50 " << ms[10] << " ms, most " << ms[19]
            << " ms, n = 20\n";
}

TEST(Guardian, HasThePriorityThatItsParentHasAskedFor) {
  constexpr int kNice = 7;
  Guardian guardian([] { setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice); });
  EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(guardian.pid())), kNice);
}

TEST(Guardian, GuardsEachDeviceAndThoseThatAreGoneNot) {
  std::array<Heard, 3> devices;
  const pid_t pid = driver([&] {
    Guardian guardian;
    guardian.guard(0, devices[0].end_of_the_driver(), written("old"));
    guardian.guard(1, devices[1].end_of_the_driver(), written("one"));
    guardian.guard(2, devices[2].end_of_the_driver(), written("two"));
    guardian.guard(0, devices[0].end_of_the_driver(), written("new"));
    guardian.forget(1);
    stream(devices[2].end_of_the_driver());
  });
  for (Heard& device : devices) device.unplug();
  for (int i = 0; i < 3; ++i) ASSERT_EQ(devices[2].next(), kForce);
  kill(pid, SIGKILL);
  EXPECT_EQ(devices[0].last(), "new");
  EXPECT_EQ(devices[1].last(), "");
  EXPECT_EQ(devices[2].last(), "two");
  ended_by(pid);
}

TEST(Guardian, WritesZeroAlsoWhenAllEndsWellAndKeepsNothingOpen) {
  Heard device;
  std::array<int, 2> said{};
  ASSERT_EQ(pipe(said.data()), 0);
  {
    Guardian guardian;
    close(said[1]);  // the descriptor of the guardian must also be closed
    char nothing = 0;
    EXPECT_EQ(read(said[0], &nothing, 1), 0);
    EXPECT_TRUE(guardian.guard(0, device.end_of_the_driver(), written(kZero)));
  }
  close(said[0]);
  device.unplug();
  EXPECT_EQ(device.next(), kZero);
  EXPECT_EQ(device.next(), "");
}

TEST(Guardian, OneThatIsDeadSaysSoAndDisturbsNobody) {
  Heard device;
  Guardian guardian;
  kill(guardian.pid(), SIGKILL);
  siginfo_t info{};
  waitid(P_PID, static_cast<id_t>(guardian.pid()), &info, WEXITED | WNOWAIT);
  EXPECT_FALSE(guardian.guard(0, device.end_of_the_driver(), written(kZero)));
}

TEST(Guardian, KnowsNoDeviceBeyondItsLast) {
  Heard device;
  Guardian guardian;
  EXPECT_FALSE(guardian.guard(Guardian::kDevices, device.end_of_the_driver(), written(kZero)));
  EXPECT_FALSE(guardian.guard(0, -1, written(kZero)));
  EXPECT_THROW(written(""), std::invalid_argument);
  EXPECT_THROW(written(std::string(65, 'A')), std::invalid_argument);
}

// The time is not checked, because virtual machines pause. It is printed for the documentation of the device.
TEST(Guardian, SaysHowLongTheForceOutlivesTheDriver) {
  std::vector<double> ms;
  for (int i = 0; i < 50; ++i) {
    Heard device;
    const pid_t pid = driver([&] {
      Guardian guardian;
      guardian.guard(0, device.end_of_the_driver(), written(kZero));
      stream(device.end_of_the_driver());
    });
    device.unplug();
    for (int packet = 0; packet < 5; ++packet) device.next();
    const auto killed = Clock::now();
    kill(pid, SIGKILL);
    std::string heard = device.next();
    while (heard == kForce) heard = device.next();
    ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - killed).count());
    ASSERT_EQ(heard, kZero);
    ended_by(pid);
  }
  std::sort(ms.begin(), ms.end());
  std::cout << "SIGKILL of the driver to zero at the device: p50 " << ms[25] << " ms, p90 " << ms[45]
            << " ms, n = 50\n";
}

LocalTime now() { return LocalTime(std::chrono::duration_cast<Duration>(Clock::now().time_since_epoch())); }

struct Killed {
  double pushed_for_ms = 0;
  bool pushes = true;                   ///< when all processes that could stop it have ended
  std::vector<std::uint8_t> last_word;  ///< endpoint and packet that the device received last
  std::uint8_t lamps = 0;
};

Killed kill_the_driver_of_a_falcon(bool guarded) {
  Heard cable;
  const pid_t pid = driver([&] {
    const auto last_word = falcon::encode(falcon::kLastCommand);
    std::optional<Guardian> guardian;
    if (guarded) {
      guardian.emplace().guard(0, cable.end_of_the_driver(),
                               ZeroPacket::usb(socket_cable::kOut, std::as_bytes(std::span(last_word))));
    }
    FalconDevice device({}, std::make_unique<socket_cable::Pipe>(cable.end_of_the_driver()));
    for (;;) {
      device.read(now());
      device.apply(Vec3(0, 0, 3));
      usleep(1000);
    }
  });
  cable.unplug();  // this process's copy
  FakeFalcon falcon({.has_firmware = true, .is_homed = true});
  socket_cable::Plug plug(falcon, cable.end_of_the_device());
  std::optional<LocalTime> killed;
  Killed result;
  int pushing = 0;
  int commands = 0;
  while (plug.turn(now())) {
    if (falcon.pushes() && falcon.commands() != std::exchange(commands, falcon.commands())) ++pushing;
    if (!killed && pushing >= 20) {
      killed = now();
      kill(pid, SIGKILL);
    }
    if (killed && falcon.pushes()) result.pushed_for_ms = seconds(now() - *killed) * 1e3;
    const timespec wait{.tv_sec = 0, .tv_nsec = std::max<Duration>(falcon.next_in() - now(), Duration(1)).count()};
    pollfd heard{.fd = cable.end_of_the_device(), .events = POLLIN, .revents = 0};
    ppoll(&heard, 1, &wait, nullptr);
  }
  ended_by(pid);
  result.pushes = falcon.pushes();
  result.lamps = falcon.lamps();
  result.last_word = plug.last();
  return result;
}

// The driver, the guardian and the signals are real. The cable is a socket, and the Falcon is a model.
TEST(Guardian, AFalconWhoseDriverIsKilledIsLeftWithoutForce) {
  const auto zero = falcon::encode(falcon::kLastCommand);
  std::vector<std::uint8_t> last_word = {socket_cable::kOut};
  last_word.insert(last_word.end(), zero.begin(), zero.end());
  std::vector<double> ms;
  for (int i = 0; i < 15; ++i) {
    const Killed killed = kill_the_driver_of_a_falcon(true);
    ASSERT_FALSE(killed.pushes);
    ASSERT_EQ(killed.last_word, last_word);
    ASSERT_EQ(killed.lamps, falcon::kRed);
    ms.push_back(killed.pushed_for_ms);
  }
  std::sort(ms.begin(), ms.end());
  std::cout << "SIGKILL of the driver to no torque at the Falcon: p50 " << ms[7] << " ms, most " << ms[14]
            << " ms, n = 15\n";
}

TEST(Guardian, AFalconWithoutOneGoesOnPushing) {
  const Killed killed = kill_the_driver_of_a_falcon(false);
  EXPECT_TRUE(killed.pushes);
}

}  // namespace
}  // namespace tendon::guardian_test
