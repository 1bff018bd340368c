// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/alias.h"

#include <algorithm>
#include <stdexcept>

namespace tendon::bridge {
namespace {

void check(const std::string& option, const std::string& name, std::size_t longest) {
  if (!name.empty() && name.size() <= longest && name.find_first_of("@: /") == std::string::npos) return;
  throw std::runtime_error(option + ": expected NAME=DEVICE, with a name of at most " + std::to_string(longest) +
                           " characters without @, :, / and spaces");
}

Alias alias_of(const std::string& text, std::vector<std::string>& devices, std::size_t longest) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  check("--name " + text, name, longest);
  if (equals == std::string::npos) {
    if (devices.empty()) devices.emplace_back();
    return {name, 0};
  }
  const std::string device = text.substr(equals + 1);
  const auto found = std::ranges::find(devices, device);
  const auto index = static_cast<std::size_t>(found - devices.begin());
  if (found == devices.end()) devices.push_back(device);
  return {name, index};
}

}  // namespace

std::vector<Alias> read_aliases(std::span<const std::string> names, std::vector<std::string>& devices,
                                std::size_t longest, const std::string& fallback) {
  std::vector<Alias> aliases;
  for (const std::string& text : names) aliases.push_back(alias_of(text, devices, longest));
  if (names.empty() && devices.empty()) aliases.push_back(alias_of(fallback, devices, longest));
  if (names.empty()) {
    for (std::size_t i = aliases.size(); i < devices.size(); ++i) {
      if (devices[i].size() > longest) check("--device " + devices[i] + " needs --name", devices[i], longest);
      aliases.push_back({devices[i], i});
    }
  }
  for (auto one = aliases.begin(); one != aliases.end(); ++one) {
    if (std::ranges::find(aliases.begin(), one, one->name, &Alias::name) != one) {
      throw std::runtime_error("--name " + one->name + ": expected unique names");
    }
  }
  return aliases;
}

}  // namespace tendon::bridge
