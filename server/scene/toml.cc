// SPDX-License-Identifier: Apache-2.0
// Compiles toml++, so that its shared library is not required.
#define TOML_IMPLEMENTATION
#include <toml++/toml.h>
