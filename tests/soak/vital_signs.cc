// SPDX-License-Identifier: Apache-2.0
#include "tests/soak/vital_signs.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <span>
#include <system_error>

namespace tendon::soak {

namespace {

std::size_t most(std::span<const VitalSigns> looks, std::size_t VitalSigns::*what) {
  std::size_t most = 0;
  for (const VitalSigns& look : looks) most = std::max(most, look.*what);
  return most;
}

}  // namespace

std::optional<VitalSigns> vital_signs(pid_t process) {
  const std::filesystem::path folder = "/proc/" + std::to_string(process);
  VitalSigns signs;
  std::size_t whole = 0;
  if (!(std::ifstream(folder / "statm") >> whole >> signs.resident)) return std::nullopt;
  signs.resident *= static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  std::error_code gone;
  const auto count = [&gone](const std::filesystem::path& of) {
    const std::filesystem::directory_iterator first(of, gone);
    return gone ? 0 : static_cast<std::size_t>(std::distance(begin(first), end(first)));
  };
  signs.files = count(folder / "fd");
  signs.threads = count(folder / "task");
  if (gone) return std::nullopt;
  return signs;
}

std::optional<std::string> not_flat(const std::string& name, const std::vector<VitalSigns>& looks,
                                    const VitalSigns& growth) {
  if (looks.size() < 10) return std::nullopt;
  const std::span<const VitalSigns> all = looks;
  const auto early = all.subspan(all.size() / 5, all.size() * 2 / 5);
  const auto late = all.subspan(all.size() * 3 / 5);
  struct Rule {
    const char* what;
    std::size_t VitalSigns::*sign;
  };
  for (const Rule& rule : {Rule{"bytes of memory", &VitalSigns::resident}, Rule{"open files", &VitalSigns::files},
                           Rule{"threads", &VitalSigns::threads}}) {
    const std::size_t before = most(early, rule.sign);
    const std::size_t after = most(late, rule.sign);
    if (after > before + growth.*rule.sign) {
      return name + ": " + rule.what + " grew from " + std::to_string(before) + " to " + std::to_string(after);
    }
  }
  return std::nullopt;
}

}  // namespace tendon::soak
