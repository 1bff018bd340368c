// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/stage/threads.h"

#include <filesystem>
#include <fstream>
#include <regex>
#include <stdexcept>

namespace tendon::e2e {

std::set<std::string> threads_of(pid_t process) {
  std::set<std::string> names;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    std::string name;
    if (std::getline(std::ifstream(task.path() / "comm"), name)) names.insert(name);
  }
  return names;
}

char state_of(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(file, text);
  const auto end = text.rfind(')');
  return end == std::string::npos ? ' ' : text.at(end + 2);
}

std::uint64_t sleeps_of(pid_t process, const std::string& thread) {
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm"), name);
    if (name != thread) continue;
    std::ifstream status(task.path() / "status");
    for (std::string word; status >> word;) {
      std::uint64_t count = 0;
      if (word == "voluntary_ctxt_switches:" && status >> count) return count;
    }
  }
  throw std::runtime_error("no thread " + thread + " in process " + std::to_string(process));
}

std::string general_name(const std::string& thread) { return std::regex_replace(thread, std::regex("-[0-9]+$"), "-N"); }

std::set<std::string> threads_of_the_page() {
  std::set<std::string> names;
  std::ifstream page(TENDON_THREADS);
  bool of_tendond = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) of_tendond = line == "## tendond";
    std::smatch row;
    if (of_tendond && std::regex_search(line, row, std::regex("^\\| `([^`]+)` \\|"))) names.insert(row[1]);
  }
  return names;
}

}  // namespace tendon::e2e
