// SPDX-License-Identifier: Apache-2.0
// This program is linked to libHD.so.
int hdInitDevice();  // NOLINT(readability-identifier-naming): OpenHaptics' name
int main() { return hdInitDevice(); }
