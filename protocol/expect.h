// SPDX-License-Identifier: Apache-2.0
#pragma once

// Makes the checks of core available to clients, which may include protocol but not core. All of them report a bad
// value as "FIELD = VALUE: expected …".

#include "core/base/expect.h"
