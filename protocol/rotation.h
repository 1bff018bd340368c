// SPDX-License-Identifier: Apache-2.0
#pragma once

// Makes the rotations of core (unit quaternions) available to clients, which may include protocol but not core.

#include "core/base/rotation.h"
