// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "devices/device.h"
#include "devices/safety/guardian.h"
#include "server/scene/scene.h"

namespace tendon {

/// The process that ends the force of the real devices when this one dies; null when no scene has a device with motors.
std::unique_ptr<Guardian> make_guardian(const std::vector<Scene>& scenes);

/// The device of `scene`. One with a plug is opened by a thread of its own as soon as it is there, and `guardian` is
/// told of it when it has motors. Throws std::runtime_error, a sentence for the operator, when a file that the scene
/// names cannot be read, or this machine has no USB.
std::unique_ptr<Device> make_device(const Scene& scene, Guardian* guardian);

}  // namespace tendon
