// SPDX-License-Identifier: Apache-2.0
#include "server/scene/reference.h"

#include "server/scene/scene.h"

namespace tendon {

std::string scene_reference() {
  std::string text;
  scene_file::Draft draft;
  scene_file::Reference reference(text);
  scene_file::declare_scene(reference, draft);
  return text;
}

}  // namespace tendon
