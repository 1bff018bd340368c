// SPDX-License-Identifier: Apache-2.0
#pragma once

// Coordinate frames. This header makes them available to clients, which may not include core.
#include "core/base/frames.h"
