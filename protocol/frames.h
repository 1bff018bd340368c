// SPDX-License-Identifier: Apache-2.0
#pragma once

// Makes the coordinate frames of core available to clients, which may include protocol but not core.
#include "core/base/frames.h"
