// SPDX-License-Identifier: Apache-2.0
// tendon-bridge chai3d: runs a CHAI3D program with a replacement of libhdPhantom.so that provides the server's devices.
#include <fcntl.h>
#include <linux/futex.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "clients/bridge/chai3d/host.h"
#include "clients/bridge/chai3d/needed.h"
#include "clients/bridge/subcommands.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/stop_signals.h"
#include "clients/cpp/usage.h"

namespace tendon::bridge {
namespace {

using chai3d::Host;
using chai3d::SharedHands;

/// A CHAI3D program counts its devices only at its start, so it is started when all have answered or after this time.
constexpr Duration kBeforeTheProgram = std::chrono::seconds(1);
constexpr int kMaxWakes = 64;  ///< wake-ups read in one turn; the program sends one for each force

struct Options {
  BridgeConfig bridge;
  std::string model;
  std::string pace = "on";
  std::vector<std::string> program;
};

// NOLINTBEGIN(concurrency-mt-unsafe): this program has one thread, and so has its child until it becomes the other one

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what + ": " + std::strerror(errno)); }

class Memory {  // shared with the program; exists as long as either process
 public:
  Memory() : file_(::memfd_create("tendon-chai3d", MFD_CLOEXEC)) {
    if (file_ < 0 || ::ftruncate(file_, sizeof(SharedHands)) != 0) fail("cannot create shared memory");
    void* const memory = ::mmap(nullptr, sizeof(SharedHands), PROT_READ | PROT_WRITE, MAP_SHARED, file_, 0);
    if (memory == MAP_FAILED) fail("cannot create shared memory");
    hands_ = new (memory) SharedHands;
  }
  ~Memory() {
    ::munmap(hands_, sizeof(SharedHands));
    ::close(file_);
  }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  SharedHands& hands() { return *hands_; }
  std::string path() const { return "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(file_); }

 private:
  int file_;
  SharedHands* hands_ = nullptr;
};

/// Socket with which the program wakes this process. It has an abstract name chosen by the kernel. The contents of
/// the datagrams are ignored, so other processes can only cause wake-ups.
class Waker {
 public:
  Waker() : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socklen_t size = sizeof address.sun_family;  // the kernel chooses the name
    if (socket_ < 0 || ::bind(socket_, reinterpret_cast<sockaddr*>(&address), size) != 0)
      fail("cannot create a socket");
    size = sizeof address;
    if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size) != 0) fail("cannot create a socket");
    name_.assign(&address.sun_path[1], size - offsetof(sockaddr_un, sun_path) - 1);
  }
  ~Waker() { ::close(socket_); }
  Waker(const Waker&) = delete;
  Waker& operator=(const Waker&) = delete;

  const std::string& name() const { return name_; }
  pollfd to_poll() const { return {socket_, POLLIN, 0}; }
  void drain() const {
    std::byte byte{};
    for (int i = 0; i < kMaxWakes && ::recv(socket_, &byte, 1, 0) >= 0; ++i) {
    }
  }

 private:
  int socket_;
  std::string name_;
};

std::filesystem::path library_folder() {
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const std::filesystem::path folder = self.parent_path() / "lib" / "tendon" / "chai3d";
  if (!std::filesystem::exists(folder / "libhdPhantom.so")) {
    throw std::runtime_error("there is no " + (folder / "libhdPhantom.so").string() +
                             ": install the package tendon-bridge");
  }
  return folder;
}

std::filesystem::path find_program(const std::string& name) {
  const auto runs = [](const std::filesystem::path& path) {
    return std::filesystem::is_regular_file(path) && ::access(path.c_str(), X_OK) == 0;
  };
  if (name.find('/') != std::string::npos) {
    if (runs(name)) return name;
  } else if (const char* const path = std::getenv("PATH")) {
    const std::string folders = path;
    for (std::size_t begin = 0; begin <= folders.size();) {
      const std::size_t end = std::min(folders.find(':', begin), folders.size());
      const std::filesystem::path candidate = std::filesystem::path(folders.substr(begin, end - begin)) / name;
      if (runs(candidate)) return candidate;
      begin = end + 1;
    }
  }
  throw std::runtime_error(name + ": expected an executable program");
}

/// A program linked to OpenHaptics would load our empty libHD.so instead of the original.
void refuse_openhaptics(const std::filesystem::path& program) {
  std::ifstream file(program, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  for (const std::string& library : chai3d::needed_libraries(std::as_bytes(std::span(bytes)))) {
    if (library.starts_with("libHD.so")) {
      throw std::runtime_error(
          program.string() + " is linked to OpenHaptics (" + library +
          "), which tendon-bridge does not replace; expected a program that uses the devices of CHAI3D");
    }
  }
}

[[noreturn]] void become(const Options& options, const std::string& memory, const std::string& wake,
                         const std::filesystem::path& libraries) {
  std::string path = libraries.string();
  if (const char* const before = std::getenv("LD_LIBRARY_PATH"); before != nullptr && *before != '\0') {
    path += std::string(":") + before;
  }
  ::setenv("LD_LIBRARY_PATH", path.c_str(), 1);
  ::setenv(chai3d::kMemoryVariable, memory.c_str(), 1);
  ::setenv(chai3d::kWakeVariable, wake.c_str(), 1);
  std::vector<char*> arguments;
  for (const std::string& argument : options.program) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  ::execvp(arguments[0], arguments.data());
  std::perror(("tendon-bridge: " + options.program[0]).c_str());
  ::_exit(127);
}

// NOLINTEND(concurrency-mt-unsafe)

/// Runs until the program exits. Returns its exit code, or 128 + the number of the signal that terminated it.
int serve(const Options& options) {
  const std::filesystem::path libraries = library_folder();
  refuse_openhaptics(find_program(options.program.front()));
  if (options.bridge.devices.size() > SharedHands::kMaxDevices) throw std::runtime_error("expected at most 16 devices");
  Memory memory;
  const Waker waker;
  SharedHands& hands = memory.hands();
  BridgeHost bridge_host(options.bridge, read_clock());
  hands.devices = static_cast<std::uint32_t>(bridge_host.size());
  hands.paced = options.pace == "on" ? 1 : 0;
  Host host(hands, {.model = options.model});
  const StopSignals signals;
  std::optional<pid_t> child;
  bool told = false;
  LocalTime next{};
  const LocalTime start = read_clock();
  for (;;) {
    LocalTime now = read_clock();
    next = bridge_host.turn(now);
    bool asked = false;
    for (std::size_t i = 0; i < bridge_host.size(); ++i) asked = host.exchange(i, bridge_host.device(i), now) || asked;
    if (host.announce()) ::syscall(SYS_futex, &hands.news, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
    if (asked) next = std::min(next, bridge_host.turn(read_clock()));
    if (!child && (hands.ready.load() != 0 || now - start >= kBeforeTheProgram)) {
      if (hands.ready.load() == 0)
        bridge_host.say("no state was received from any device; starting the program without a device");
      const std::string path = memory.path();
      child = ::fork();
      if (*child < 0) fail("cannot start the program");
      if (*child == 0) become(options, path, waker.name(), libraries);
    }
    if (int status = 0; child && ::waitpid(*child, &status, WNOHANG) == *child) {
      bridge_host.stop(read_clock());
      return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    if (signals.asked() && !std::exchange(told, true)) {
      if (!child) return 0;
      ::kill(*child, SIGTERM);  // the loop ends with the program
    }
    std::array<pollfd, 1> programs = {waker.to_poll()};
    bridge_host.wait(programs, read_clock(), next);
    if (programs[0].revents != 0) waker.drain();
  }
}

}  // namespace

void add_chai3d(CLI::App& app, Chosen& chosen) {
  static Options options;  // written by CLI11 while parsing
  CLI::App& command = *app.add_subcommand(
      "chai3d", "Start an existing program that is built with CHAI3D. It sees the devices as Phantoms");
  command.footer("Example: tendon-bridge chai3d --server lab:47100 --key wall.key -- ./01-mydevice");
  add_common(command, options.bridge);
  command
      .add_option("--model", options.model,
                  "Name of the model, such as \"PHANTOM Omni\", for programs that require one. Empty: the name of the "
                  "device. CHAI3D sets its limits by the names that it knows")
      ->type_name("NAME")
      ->check(CLI::Validator(
          [](const std::string& text) { return text.size() < 255 ? "" : "expected at most 254 bytes"; }, ""));
  command
      .add_option("--pace", options.pace,
                  "on: setting a force waits for the next state, at most 2 ms. off: do not wait, for programs that "
                  "sleep themselves")
      ->check(usage::one_of({"on", "off"}))
      ->capture_default_str();
  command.add_option("PROGRAM", options.program, "Program and its arguments, after --")->required();
  command.positionals_at_end();
  command.callback([&chosen] { chosen = [] { return serve(options); }; });
}

}  // namespace tendon::bridge
