// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/server_process.h"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "server/machine/clock.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;
namespace fs = std::filesystem;

constexpr Duration kStartPatience = std::chrono::seconds(20);
constexpr const char* kSaid = "tendond.jsonl";
constexpr const char* kLog = "tendond.log";

std::string text_of_file(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_to(int descriptor, const fs::path& file) {
  const int opened = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (opened < 0 || ::dup2(opened, descriptor) < 0) fail(file.string());
}

void run_tendond(const fs::path& program, const fs::path& scene) {
  write_to(STDOUT_FILENO, scene.parent_path() / kSaid);
  write_to(STDERR_FILENO, scene.parent_path() / kLog);
  const std::string name = program.string();
  const std::string file = scene.string();
  ::execl(name.c_str(), name.c_str(), file.c_str(), "--json", nullptr);
  fail(name);
}

std::string name_of_thread(const fs::path& task) {
  std::string name = text_of_file(task / "comm");
  if (name.ends_with('\n')) name.pop_back();
  return name;
}

bool is_haptic(const std::string& name) { return name.starts_with("haptic-"); }

template <class Visit>
void for_each_thread(pid_t process, Visit visit) {
  for (const auto& task : fs::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    visit(task.path(), name_of_thread(task.path()));
  }
}

}  // namespace

ServerProcess::ServerProcess(const fs::path& scene, int priority) : folder_(scene.parent_path()) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "tendond";
  if (!fs::exists(program)) throw std::runtime_error(program.string() + ": no such file");
  const LocalTime began = clock::now();
  process_ = std::make_unique<OtherProcess>([&] { run_tendond(program, scene); });
  const std::string before = "\"address\":\"";
  std::size_t at = std::string::npos;
  std::string said;
  while (said.find('\n') == std::string::npos || (at = said.find(before)) == std::string::npos) {
    if (clock::now() - began > kStartPatience) throw std::runtime_error("tendond does not listen");
    process_->check();
    clock::sleep_until(clock::now() + milliseconds(1));
    said = output();
  }
  started_ = clock::now() - began;
  at += before.size();
  address_ = parse_address(said.substr(at, said.find('"', at) - at));
  if (priority == 0) return;
  const sched_param param{.sched_priority = priority};
  for_each_thread(process_->pid(), [&](const fs::path& task, const std::string& name) {
    if (is_haptic(name)) return;
    const pid_t thread = std::atoi(task.filename().c_str());
    if (::sched_setscheduler(thread, SCHED_FIFO, &param) != 0) fail("SCHED_FIFO " + std::to_string(priority));
  });
}

ServerProcess::~ServerProcess() {
  if (process_) process_->signal(SIGKILL);
}

std::string ServerProcess::output() const { return text_of_file(folder_ / kSaid); }

std::uint64_t ServerProcess::resident() const {
  std::ifstream pages("/proc/" + std::to_string(process_->pid()) + "/statm");
  std::uint64_t all = 0;
  std::uint64_t present = 0;
  pages >> all >> present;
  return present * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

ServerProcess::Spent ServerProcess::spent() const {
  Spent sum;
  for_each_thread(process_->pid(), [&](const fs::path& task, const std::string& name) {
    std::ifstream stat(task / "schedstat");
    Duration::rep ns = 0;
    stat >> ns;
    Duration& part = is_haptic(name) ? sum.haptic : name.starts_with("network") ? sum.network : sum.rest;
    part += Duration(ns);
  });
  return sum;
}

std::string ServerProcess::stop() {
  process_->signal(SIGINT);
  process_.reset();
  const std::string said = output();
  const std::size_t last = said.rfind("{\"event\":\"stopped\"");
  if (last == std::string::npos) throw std::runtime_error("tendond has not printed its summary");
  return said.substr(last);
}

}  // namespace tendon::bench
