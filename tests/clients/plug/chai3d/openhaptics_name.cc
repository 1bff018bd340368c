// SPDX-License-Identifier: Apache-2.0
// Builds a library with the name of OpenHaptics' libHD.so.
int hdInitDevice();
int hdInitDevice() { return 0; }
