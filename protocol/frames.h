// SPDX-License-Identifier: Apache-2.0
#pragma once

// The frames of programs and interfaces, for guests: where a device's axes are before the operator, and other programs'.
#include "core/base/frames.h"
