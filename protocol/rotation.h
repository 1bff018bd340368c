// SPDX-License-Identifier: Apache-2.0
#pragma once

// Unit quaternions. This header makes them available to clients, which may not include core.

#include "core/base/rotation.h"
