// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/devices.h"

#include <variant>

#include "protocol/wire/text.h"
#include "server/recording/recording_reader.h"
#include "server/scene/scene.h"

namespace tendon::lab {
namespace {

std::string name_in(const SceneRecord& scene) {
  const std::string unnamed = "first";
  try {
    return parse_scene(scene.text, unnamed, ".").name_of(0);
  } catch (const SceneError&) {  // scene of another version, or with files that are missing here
    return unnamed;
  }
}

}  // namespace

std::vector<std::string> device_names(const std::filesystem::path& recording) {
  RecordingReader reader(recording, RecordingReader::Devices::kAll);
  std::string first = "first";
  while (const auto record = reader.next()) {
    const auto* const scene = std::get_if<SceneRecord>(&*record);
    if (scene == nullptr) break;  // all scenes are at the front
    if (reader.device() == 0) first = name_in(*scene);
  }
  std::vector<std::string> names = reader.devices();
  names.front() = first;
  for (std::string& name : names) name = visible(name);
  return names;
}

}  // namespace tendon::lab
