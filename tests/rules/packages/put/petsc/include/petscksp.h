// SPDX-License-Identifier: Apache-2.0
// This header replaces the one from the package.
#pragma once

#include <mpi.h>
