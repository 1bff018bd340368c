// SPDX-License-Identifier: Apache-2.0
// A library with the name of OpenHaptics' libHD.so.
int hdInitDevice();
int hdInitDevice() { return 0; }
