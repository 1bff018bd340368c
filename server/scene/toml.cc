// SPDX-License-Identifier: Apache-2.0
// The functions of toml++, which are then not in a shared library whose symbols have to be found at startup.
#define TOML_IMPLEMENTATION
#include <toml++/toml.h>
