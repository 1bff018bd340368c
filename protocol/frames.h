// SPDX-License-Identifier: Apache-2.0
#pragma once

// For clients, which may not include core.
#include "core/base/frames.h"
