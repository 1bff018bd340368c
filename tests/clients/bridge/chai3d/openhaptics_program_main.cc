// SPDX-License-Identifier: Apache-2.0
// Linked to libHD.so.
int hdInitDevice();  // NOLINT(readability-identifier-naming): OpenHaptics' name
int main() { return hdInitDevice(); }
