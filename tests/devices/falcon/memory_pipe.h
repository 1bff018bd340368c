// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/model_pipe.h"

namespace tendon {

using MemoryPipe = ModelPipe<FakeFalcon>;

}  // namespace tendon
