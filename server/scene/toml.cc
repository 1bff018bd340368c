// SPDX-License-Identifier: Apache-2.0
// Compiles toml++, so that its shared library is not required. Files with errors violate some of its assertions, which
// would abort a debug build, and which a release build would assume. Without them, the errors are reported.
#undef NDEBUG
#define TOML_ASSERT(condition) static_cast<void>(0)
#define TOML_IMPLEMENTATION
#include <toml++/toml.h>
