// SPDX-License-Identifier: Apache-2.0
// This header replaces the one from the package.
#pragma once

extern "C" int MPI_Init(int* count, char*** words);
#define MPI_VERSION 3
#define MPI_SUBVERSION 1
