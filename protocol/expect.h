// SPDX-License-Identifier: Apache-2.0
#pragma once

// The one form in which impossible values are refused, "FIELD = VALUE: expected …", for clients too: they may include
// protocol and nothing of core.

#include "core/base/expect.h"
