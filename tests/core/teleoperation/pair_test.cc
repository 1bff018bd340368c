// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/purse.h"
#include <gtest/gtest.h>
