// SPDX-License-Identifier: Apache-2.0
// This file is used to compile the precompiled headers for the optimized tests (see tests/CMakeLists.txt).
