// SPDX-License-Identifier: Apache-2.0
// Only there to carry the precompiled headers of the tests (tests/CMakeLists.txt).
