// SPDX-License-Identifier: Apache-2.0
#pragma once

// Checks of the form "FIELD = VALUE: expected …". This header makes them available to clients, which may not include
// core.

#include "core/base/expect.h"
