// SPDX-License-Identifier: Apache-2.0
// Builds a library with the name of OpenHaptics' libHD.so.
int hdInitDevice();               // NOLINT(readability-identifier-naming): OpenHaptics' name
int hdInitDevice() { return 0; }  // NOLINT(readability-identifier-naming)
