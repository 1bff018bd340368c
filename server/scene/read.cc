// SPDX-License-Identifier: Apache-2.0
#include <toml++/toml.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "protocol/limits.h"
#include "server/clients/served_client.h"
#include "server/machine/regular_file.h"
#include "server/scene/keys.h"
#include "server/scene/reader.h"
#include "server/scene/resolver.h"
#include "server/scene/scene.h"
#include "server/scene/values.h"

namespace tendon {
namespace {

/// "TABLE.KEY=VALUE" sets a key, and "TABLE.KEY=" removes it.
void apply_setting(toml::table& file, const std::string& setting) {
  const auto refuse = [&setting](const std::string& why) {
    throw SceneError("setting " + scene_file::in_quotes(setting) + ": " + why);
  };
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) refuse("expected TABLE.KEY=VALUE");
  std::string_view path = std::string_view(setting).substr(0, equals);
  const std::string value = setting.substr(equals + 1);

  toml::table* table = &file;
  for (std::size_t dot = path.find('.'); dot != std::string_view::npos; dot = path.find('.')) {
    const std::string_view name = path.substr(0, dot);
    path.remove_prefix(dot + 1);
    if (!table->contains(name)) {
      if (value.empty()) return;
      table->insert(name, toml::table{});
    }
    table = table->get_as<toml::table>(name);
    if (table == nullptr) refuse(scene_file::in_quotes(name) + " is not a table");
  }
  if (value.empty()) {
    table->erase(path);
    return;
  }
  try {
    const toml::table parsed = toml::parse("value = " + value);
    table->insert_or_assign(path, *parsed.get("value"));
  } catch (const toml::parse_error&) {
    table->insert_or_assign(path, value);
  }
}

std::string text_of(const toml::table& file) {
  std::ostringstream text;
  text << toml::toml_formatter(file, toml::toml_formatter::default_flags & ~toml::format_flags::indentation) << '\n';
  return text.str();
}

}  // namespace

std::vector<std::string> limiter_settings(std::string_view law, const HapticController::Config& control) {
  std::vector<std::string> settings{"limiter=", "limiter.kind=\"" + std::string(law) + '"'};
  const auto keep = [&settings](std::string_view table, const Friction& friction, std::string_view coulomb,
                                std::string_view viscous) {
    const std::string prefix = std::string(table) + '.';
    settings.push_back(prefix + std::string(coulomb) + '=' + scene_file::digits(friction.coulomb));
    settings.push_back(prefix + std::string(viscous) + '=' + scene_file::digits(friction.viscous));
  };
  keep("limiter", control.limiter.friction, "coulomb_friction_n", "viscous_friction_n_s_per_m");
  if (control.rotation) {
    keep("limiter.rotation", control.rotation->friction, "coulomb_friction_nm", "viscous_friction_nm_s_per_rad");
  }
  if (control.grip) {
    keep("limiter.gripper", control.grip->friction, "coulomb_friction_n", "viscous_friction_n_s_per_m");
  }
  return settings;
}

Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory,
                  std::span<const std::string> settings) {
  if (text.size() > kMaxSceneBytes) {
    throw SceneError(name + ": expected a scene of at most " + std::to_string(kMaxSceneBytes) + " bytes, found more");
  }
  toml::table file = scene_file::parse_toml(text, name);
  for (const std::string& setting : settings) apply_setting(file, setting);
  scene_file::Draft draft;
  draft.scene.text = settings.empty() ? std::string(text) : text_of(file);
  if (draft.scene.text.size() > kMaxSceneBytes)
    throw SceneError(name + ": with the settings, the scene has more than " + std::to_string(kMaxSceneBytes) +
                     " bytes");
  draft.scene.has_network = file.contains("network");
  draft.scene.name = scene_file::label_of(std::filesystem::path(name).stem().string());
  scene_file::SceneProblems problems;
  scene_file::Reader reader(problems, &file, "", {});
  scene_file::declare_scene(reader, draft);
  reader.refuse_unknown();
  problems.throw_first(name);
  return scene_file::resolve(std::move(draft), file, name, directory);
}

Scene read_scene(const std::filesystem::path& file) {
  std::string text(kMaxSceneBytes + 1, '\0');
  try {
    std::ifstream stream = open_regular_file(file);
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
  } catch (const UnreadableFile& refused) {
    throw SceneFileError(refused.what());
  }
  return parse_scene(text, file.string(), file.parent_path());
}

namespace {

void check_network_threads(const std::vector<Scene>& scenes, const std::string& file) {
  const auto& threads = scenes.front().network.threads;
  if (!threads) return;
  const auto refuse = [&](const std::string& expected) {
    throw SceneError(file + ": network.threads: expected " + expected + ", found " + std::to_string(*threads));
  };
  const std::size_t devices = scenes.back().loop.device + scenes.back().count;
  const std::size_t banks = (devices + limits::kMaxDevices - 1) / limits::kMaxDevices;
  if (!std::has_single_bit(*threads) || *threads > banks) {
    refuse("a power of two, at most the number of banks of " + std::to_string(limits::kMaxDevices) + " devices, " +
           std::to_string(banks));
  }
  const std::string_view key = needs_one_network_thread(scenes);
  if (*threads > 1 && !key.empty()) refuse("1 with " + std::string(key));
}

}  // namespace

std::vector<Scene> read_scenes(const std::vector<std::filesystem::path>& files, const Overrides& overrides) {
  std::vector<Scene> scenes;
  std::unordered_map<std::string, std::filesystem::path> names;
  std::uint32_t place = 0;
  for (const std::filesystem::path& file : files) {
    Scene scene = read_scene(file);
    if (const auto settings = overrides ? overrides(scene) : std::vector<std::string>(); !settings.empty()) {
      scene = parse_scene(scene.text, file.string(), file.parent_path(), settings);
    }
    scene.loop.device = place;
    place += scene.count;
    if (place > kMostDevices) {
      throw SceneError(file.string() + ": device.count: expected at most " + std::to_string(kMostDevices) +
                       " devices of all scenes, found " + std::to_string(place));
    }
    if (!scene.shares_thread() && scene.loop.device >= limits::kMaxDevices) {
      throw SceneError(file.string() + ": device.kind: expected USB devices among the first " +
                       std::to_string(limits::kMaxDevices) + ", found " + std::to_string(scene.loop.device) +
                       " before it: list its scene first");
    }
    for (std::uint32_t index = 0; index < scene.count; ++index) {
      const auto [first, is_new] = names.emplace(scene.name_of(index), file);
      if (is_new) continue;
      throw SceneError(file.string() + ": device.name: expected a unique name, found " +
                       scene_file::in_quotes(first->first) + " again, which is in " + first->second.string());
    }
    for (const auto& [name, there] :
         {std::pair("network", scene.has_network), std::pair("recording", scene.recording.has_value())}) {
      if (!there || scenes.empty()) continue;
      throw SceneError(file.string() + ": " + name + ": expected only in the first scene, " + files.front().string());
    }
    scenes.push_back(std::move(scene));
  }
  if (!scenes.empty()) check_network_threads(scenes, files.front().string());
  return scenes;
}

}  // namespace tendon
