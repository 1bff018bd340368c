// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "devices/device.h"
#include "devices/safety/guardian.h"
#include "server/scene/scene.h"

namespace tendon {

/// Creates the guardian process (devices/safety/guardian.h). Returns null if no scene has a device with motors.
std::unique_ptr<Guardian> make_guardian(const std::vector<Scene>& scenes);

/// Creates the device of `scene`. A USB device is opened by its own thread as soon as it is plugged in, and registered
/// with `guardian` if it has motors. Throws std::runtime_error with a message for the operator if a file that the scene
/// names cannot be read or if this machine has no USB.
std::unique_ptr<Device> make_device(const Scene& scene, Guardian* guardian);

}  // namespace tendon
