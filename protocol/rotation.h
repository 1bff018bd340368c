// SPDX-License-Identifier: Apache-2.0
#pragma once

// Rotations as unit quaternions, for clients too: they may include protocol and nothing of core.

#include "core/base/rotation.h"
